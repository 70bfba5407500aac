// Stable Neo-Hookean (Smith, de Goes, Kim 2018, eq. 14):
//   psi = mu/2 (I_C - 3) + lambda/2 (J - alpha)^2 - mu/2 log(I_C + 1),  alpha = 1 + mu/lambda - mu/(4 lambda)
// less its value at rest. mu and lambda are the reparametrised constants of their section 3.4.
#pragma once

#include "materials/invariant_material.hpp"

namespace qlb {

template <class V>
struct StableNeoHookean : InvariantMaterial<V, StableNeoHookean<V>> {
  static constexpr const char* name = "SNH";
  static constexpr int parameter_count = 2;
  static constexpr bool uses_I2 = false;

  V mu, lambda, alpha;

  explicit StableNeoHookean(const V* parameters)
      : mu(parameters[0]), lambda(parameters[1]), alpha(V(1.0) + V(0.75) * mu / lambda) {}

  V psi(const Invariants<V>& I) const {
    const V change = I.J - V(1.0);  // (J - alpha)^2 - (1 - alpha)^2 without cancellation
    return V(0.5) * (mu * (I.I1 - V(3.0) - xsimd::log(V(0.25) * (I.I1 + V(1.0)))) +
                     lambda * change * (change + V(2.0) * (V(1.0) - alpha)));
  }

  InvariantDerivatives<V> derivatives(const Invariants<V>& I) const {
    const V r = V(1.0) / (I.I1 + V(1.0));
    InvariantDerivatives<V> d;
    d.d1 = V(0.5) * mu * (V(1.0) - r);
    d.d11 = V(0.5) * mu * r * r;
    d.dJ = lambda * (I.J - alpha);
    d.dJJ = lambda;
    return d;
  }
};

QLB_MATERIAL(StableNeoHookean);

}  // namespace qlb
