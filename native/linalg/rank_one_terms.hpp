// A sum of rank-one matrices, C K C^T = sum_j stiffness_j a_j a_j^T, such as the Hessian of contacts and friction.
//
// a_j has a vector for each of up to four nodes, and is zero elsewhere; along the normal of a contact that is gamma_ji
// axis_j at node i. A node that is repeated in a term adds up.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace qlb {

class RankOneTerms {
 public:
  // nodes (count, 4), gamma (count, 4), axis (count, 3), stiffness (count).
  RankOneTerms(std::span<const std::int32_t> nodes, std::span<const double> gamma, std::span<const double> axis,
               std::span<const double> stiffness);
  // vectors (count, 4, 3)
  RankOneTerms(std::span<const std::int32_t> nodes, std::span<const double> vectors, std::span<const double> stiffness);
  RankOneTerms() = default;

  void reserve(std::int64_t count);
  void add(const std::array<std::int32_t, 4>& nodes, const std::array<double, 12>& vector, double stiffness);
  // gamma (x) axis
  void add(const std::array<std::int32_t, 4>& nodes, const std::array<double, 4>& gamma,
           const std::array<double, 3>& axis, double stiffness);
  void add(const RankOneTerms& others);
  void set_stiffness(std::int64_t j, double stiffness) { stiffness_[j] = stiffness; }

  std::int64_t size() const { return static_cast<std::int64_t>(stiffness_.size()); }
  const std::array<std::int32_t, 4>& nodes(std::int64_t j) const { return nodes_[j]; }
  // a_j at its node i
  std::array<double, 3> vector(std::int64_t j, int i) const {
    return {vector_[j][3 * i], vector_[j][3 * i + 1], vector_[j][3 * i + 2]};
  }
  double stiffness(std::int64_t j) const { return stiffness_[j]; }
  const std::vector<std::array<std::int32_t, 4>>& all_nodes() const { return nodes_; }
  const std::vector<std::array<double, 12>>& all_vectors() const { return vector_; }
  const std::vector<double>& all_stiffness() const { return stiffness_; }

  // Throws std::invalid_argument where a term has a node outside [0, nodes).
  void check_nodes(std::int64_t nodes) const;

  // a_j . v, v (nodes, 3)
  double dot(std::int64_t j, const double* v) const {
    const double* a = vector_[j].data();
    double part[4];
    for (int i = 0; i < 4; ++i) {
      const double* at = v + 3 * static_cast<std::int64_t>(nodes_[j][i]);
      part[i] = a[3 * i] * at[0] + a[3 * i + 1] * at[1] + a[3 * i + 2] * at[2];
    }
    return (part[0] + part[1]) + (part[2] + part[3]);
  }
  void add_to(std::int64_t j, double scale, double* out) const;           // out += scale a_j
  void add_combination(std::span<const double> beta, double* out) const;  // out += C beta
  // out += scale C K C^T v, K of `stiffness`
  void add_product(const double* v, double* out, double scale, std::span<const double> stiffness) const;

 private:
  void take(std::span<const std::int32_t> nodes, std::span<const double> stiffness);

  std::vector<std::array<std::int32_t, 4>> nodes_;
  std::vector<std::array<double, 12>> vector_;
  std::vector<double> stiffness_;
  std::int32_t last_node_ = -1;
};

}  // namespace qlb
