// Linear elasticity: psi = mu eps:eps + lambda/2 (tr eps)^2, eps = (F + F^T)/2 - 1. Not objective: for small
// rotations.
#pragma once

#include "materials/material.hpp"

namespace qlb {

template <class V>
struct LinearElastic {
  static constexpr const char* name = "linear";
  static constexpr int parameter_count = 2;
  static constexpr HessianForm hessian_form = HessianForm::kConvexStiffness;

  V mu, lambda;

  explicit LinearElastic(const V* parameters) : mu(parameters[0]), lambda(parameters[1]) {}

  V energy(const Mat3<V>& F) const {
    const Mat3<V> eps = strain(F);
    const V trace = eps(0, 0) + eps(1, 1) + eps(2, 2);
    return mu * contract(eps, eps) + V(0.5) * lambda * trace * trace;
  }

  V energy_stress(const Mat3<V>& F, Mat3<V>& P) const {
    const Mat3<V> eps = strain(F);
    const V trace = eps(0, 0) + eps(1, 1) + eps(2, 2);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) P(i, j) = V(2.0) * mu * eps(i, j) + (i == j ? lambda * trace : V(0.0));
    return mu * contract(eps, eps) + V(0.5) * lambda * trace * trace;
  }

  Stiffness9<V> stiffness(const Mat3<V>&) const {
    Stiffness9<V> C;
    for (int p = 0; p < 9; ++p)
      for (int q = 0; q <= p; ++q) {
        const int i = p / 3, k = p % 3, j = q / 3, l = q % 3;
        V c(0.0);
        if (i == k && j == l) c += lambda;
        if (i == j && k == l) c += mu;
        if (i == l && k == j) c += mu;
        C(p, q) = c;
      }
    return C;
  }

 private:
  static Mat3<V> strain(const Mat3<V>& F) {
    Mat3<V> eps;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) eps(i, j) = V(0.5) * (F(i, j) + F(j, i)) - V(i == j ? 1.0 : 0.0);
    return eps;
  }
};

QLB_MATERIAL(LinearElastic);

}  // namespace qlb
