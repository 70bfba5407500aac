// St. Venant-Kirchhoff (Bonet, Wood 2008, eq. 6.23): psi = mu E:E + lambda/2 (tr E)^2, E = (F^T F - 1)/2.
// In invariants: E:E = (tr C^2 - 2 I1 + 3)/4 with tr C^2 = I1^2 - 2 I2, and tr E = (I1 - 3)/2.
#pragma once

#include "materials/invariant_material.hpp"

namespace qlb {

template <class V>
struct StVenantKirchhoff : InvariantMaterial<V, StVenantKirchhoff<V>> {
  static constexpr const char* name = "StVK";
  static constexpr int parameter_count = 2;
  static constexpr bool uses_I2 = true;

  V mu, lambda;

  explicit StVenantKirchhoff(const V* parameters) : mu(parameters[0]), lambda(parameters[1]) {}

  V psi(const Invariants<V>& I) const {
    const V a = I.I1 - V(3.0), b = I.I2 - V(3.0);  // tr C^2 - 2 I1 + 3 = a^2 + 4 a - 2 b
    return V(0.25) * mu * (a * a + V(4.0) * a - V(2.0) * b) + V(0.125) * lambda * a * a;
  }

  InvariantDerivatives<V> derivatives(const Invariants<V>& I) const {
    InvariantDerivatives<V> d;
    d.d1 = V(0.5) * mu * (I.I1 - V(1.0)) + V(0.25) * lambda * (I.I1 - V(3.0));
    d.d2 = V(-0.5) * mu;
    d.d11 = V(0.5) * mu + V(0.25) * lambda;
    return d;
  }
};

QLB_MATERIAL(StVenantKirchhoff);

}  // namespace qlb
