// Compressible Neo-Hookean (Bonet, Wood 2008, eq. 6.27): psi = mu/2 (I_C - 3) - mu log J + lambda/2 log(J)^2.
// Not defined for J <= 0, where it is NaN.
#pragma once

#include "materials/invariant_material.hpp"

namespace qlb {

template <class V>
struct CompressibleNeoHookean : InvariantMaterial<V, CompressibleNeoHookean<V>> {
  static constexpr const char* name = "CNH";
  static constexpr int parameter_count = 2;
  static constexpr bool uses_I2 = false;

  V mu, lambda;

  explicit CompressibleNeoHookean(const V* parameters) : mu(parameters[0]), lambda(parameters[1]) {}

  V psi(const Invariants<V>& I) const {
    const V L = log_or_nan(I.J);
    return V(0.5) * mu * (I.I1 - V(3.0)) + (V(0.5) * lambda * L - mu) * L;
  }

  InvariantDerivatives<V> derivatives(const Invariants<V>& I) const {
    const V L = log_or_nan(I.J), r = V(1.0) / I.J;
    InvariantDerivatives<V> d;
    d.d1 = V(0.5) * mu;
    d.dJ = (lambda * L - mu) * r;
    d.dJJ = (lambda - lambda * L + mu) * r * r;
    return d;
  }
};

QLB_MATERIAL(CompressibleNeoHookean);

}  // namespace qlb
