// Coulomb friction as a potential: smooth, with the normal forces and contact points of an earlier configuration (Li et
// al. 2020, "Incremental Potential Contact", section 5).
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "contact/potentials.hpp"
#include "contact/tangents.hpp"

namespace qlb {

// f0(y) for the size y of a slip [m]: f0' = f1(y) = -y^2/eps^2 + 2 y/eps for y < eps, else 1, and f0(eps) = eps.
inline Derivatives smooth_friction(double y, double epsilon) {
  if (y >= epsilon) return {y, 1.0, 0.0};
  const double r = y / epsilon;
  return {epsilon * (r * r * (1.0 - r / 3.0) + 1.0 / 3.0), r * (2.0 - r), 2.0 * (1.0 - r) / epsilon};
}

// The energy and its Hessian, as rank-one terms: two per contact, along its slip and across.
struct FrictionTerms {
  double energy = 0.0;
  std::vector<std::array<std::int32_t, 4>> nodes;
  std::vector<std::array<double, 4>> gamma;
  std::vector<std::array<double, 3>> axis;
  std::vector<double> stiffness;
  std::vector<std::array<double, 3>> slip;  // of each contact, u [m]

  // By how much the friction of each contact has grown along the change of its slip since `before`, over that change; 0
  // where that is none. Both of the same contacts.
  std::vector<double> secant(const FrictionTerms& before) const;
};

class Friction {
 public:
  // nodes, gamma (k, 4), normal (k, 3); normal_force [N], mu (k); slip (k, 3) [m]: what the second primitive (a plane)
  // moves by itself, or empty.
  Friction(std::span<const std::int32_t> nodes, std::span<const double> gamma, std::span<const double> normal,
           std::span<const double> normal_force, std::span<const double> mu, std::span<const double> slip);

  std::int64_t size() const { return static_cast<std::int64_t>(contacts_.size()); }

  // The energy is scale sum mu lambda f0(|u|) of the slips u = T^T (sum_i gamma_i (x_i - base_i) - slip) [m]. Adds its
  // gradient to `gradient`. x, base, gradient: (count, 3); epsilon [m]: below this slip, friction holds.
  FrictionTerms evaluate(const double* x, const double* base, std::int64_t count, double epsilon, double scale,
                         double* gradient) const;

 private:
  struct Contact {
    std::array<std::int32_t, 4> nodes;
    std::array<double, 4> gamma;
    std::array<Vec3, 2> tangents;
    Vec3 slip;
    double limit;  // mu times the normal force [N]
  };
  std::vector<Contact> contacts_;
  std::int32_t last_node_ = -1;
};

}  // namespace qlb
