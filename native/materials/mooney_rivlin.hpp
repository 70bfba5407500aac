// Mooney-Rivlin, nearly incompressible form (Bonet, Wood 2008, section 6.5.3):
//   psi = c1 (J^-2/3 I1 - 3) + c2 (J^-4/3 I2 - 3) + kappa/2 (J - 1)^2
// Not defined for J <= 0, where it is NaN.
#pragma once

#include "materials/invariant_material.hpp"

namespace qlb {

template <class V>
struct MooneyRivlin : InvariantMaterial<V, MooneyRivlin<V>> {
  static constexpr const char* name = "MR";
  static constexpr int parameter_count = 3;
  static constexpr bool uses_I2 = true;

  V c1, c2, kappa;

  explicit MooneyRivlin(const V* parameters) : c1(parameters[0]), c2(parameters[1]), kappa(parameters[2]) {}

  V psi(const Invariants<V>& I) const {
    const V p = power(I.J), volume = I.J - V(1.0);
    return c1 * (p * I.I1 - V(3.0)) + c2 * (p * p * I.I2 - V(3.0)) + V(0.5) * kappa * volume * volume;
  }

  InvariantDerivatives<V> derivatives(const Invariants<V>& I) const {
    const V p = power(I.J), r = V(1.0) / I.J;
    const V a = c1 * p, b = c2 * p * p, third = V(1.0 / 3.0);
    InvariantDerivatives<V> d;
    d.d1 = a;
    d.d2 = b;
    d.d1J = V(-2.0) * third * a * r;
    d.d2J = V(-4.0) * third * b * r;
    d.dJ = d.d1J * I.I1 + d.d2J * I.I2 + kappa * (I.J - V(1.0));
    d.dJJ = (V(10.0 / 9.0) * a * I.I1 + V(28.0 / 9.0) * b * I.I2) * r * r + kappa;
    return d;
  }

 private:
  // J^-2/3
  static V power(const V& J) { return xsimd::exp(V(-2.0 / 3.0) * log_or_nan(J)); }
};

QLB_MATERIAL(MooneyRivlin);

}  // namespace qlb
