// Kelvin-Voigt viscosity over one stage: psi = k |E - E_b|^2, E = (F^T F - 1)/2 the Green strain, E_b a given
// strain. Its stress S = 2 k (E - E_b) is 2 eta dE/dt for k = eta/c (see src/qlb/energies/damping.py).
#pragma once

#include "materials/material.hpp"
#include "simd/psd9.hpp"

namespace qlb {

template <class V>
struct Viscous {
  static constexpr const char* name = "viscous";
  static constexpr int parameter_count = 7;  // k; E_b: xx, yy, zz, yz, zx, xy
  static constexpr HessianForm hessian_form = HessianForm::kStiffnessPair;

  V k;
  Mat3<V> base;

  explicit Viscous(const V* parameters) : k(parameters[0]) {
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, l = (i + 2) % 3;
      base(i, i) = parameters[1 + i];
      base(j, l) = base(l, j) = parameters[4 + i];
    }
  }

  V energy(const Mat3<V>& F) const {
    const Mat3<V> change = strain_change(F);
    return k * contract(change, change);
  }

  // P = F S
  V energy_stress(const Mat3<V>& F, Mat3<V>& P) const {
    const Mat3<V> change = strain_change(F), product = F * change;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) P(i, j) = V(2.0) * k * product(i, j);
    return k * contract(change, change);
  }

  // C_(ik)(jl) = d_ij S_kl + k (F_il F_jk + (F F^T)_ij d_kl)
  Stiffness9<V> stiffness(const Mat3<V>& F) const {
    const Mat3<V> change = strain_change(F);
    Mat3<V> left;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) left(i, j) = F(i, 0) * F(j, 0) + F(i, 1) * F(j, 1) + F(i, 2) * F(j, 2);
    Stiffness9<V> C;
    for (int p = 0; p < 9; ++p)
      for (int q = 0; q <= p; ++q) {
        const int i = p / 3, m = p % 3, j = q / 3, l = q % 3;
        V c = F(i, l) * F(j, m);
        if (i == j) c += V(2.0) * change(m, l);
        if (m == l) c += left(i, j);
        C(p, q) = k * c;
      }
    return C;
  }

  Stiffness9<V> projected_stiffness(const Mat3<V>& F) const { return project_psd(stiffness(F)); }

 private:
  Mat3<V> strain_change(const Mat3<V>& F) const {
    const Mat3<V> right = transpose_times(F, F);
    Mat3<V> change;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) change(i, j) = V(0.5) * (right(i, j) - V(i == j ? 1.0 : 0.0)) - base(i, j);
    return change;
  }
};

QLB_MATERIAL(Viscous);

}  // namespace qlb
