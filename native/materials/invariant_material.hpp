// Isotropic energies given by invariants of F: I1 = |F|^2 = tr C, I2 = |cof F|^2 = (I1^2 - tr C^2)/2, J = det
// F.
//
// A material derives from InvariantMaterial<V, Self> and writes down psi and its first and second derivatives
// with respect to (I1, I2, J), nothing else; stress, stiffness and spectrum follow here, once for all.
#pragma once

#include "materials/material.hpp"

namespace qlb {

template <class V>
struct Invariants {
  V I1, I2, J;
};

// First and second partial derivatives of psi. A material leaves out what is zero.
template <class V>
struct InvariantDerivatives {
  V d1 = V(0.0), d2 = V(0.0), dJ = V(0.0);
  V d11 = V(0.0), d22 = V(0.0), dJJ = V(0.0), d1J = V(0.0), d2J = V(0.0), d12 = V(0.0);
};

// Self supplies: static constexpr bool uses_I2;  V psi(Invariants);  InvariantDerivatives<V>
// derivatives(Invariants).
template <class V, class Self>
struct InvariantMaterial {
  static constexpr HessianForm hessian_form = HessianForm::kStiffnessAndSpectrum;

  V energy(const Mat3<V>& F) const { return self().psi(invariants(F, cofactor(F))); }

  // P = 2 psi_1 F + 2 psi_2 (I1 F - F F^T F) + psi_J cof F
  V energy_stress(const Mat3<V>& F, Mat3<V>& P) const {
    const Mat3<V> G = cofactor(F);
    const Invariants<V> I = invariants(F, G);
    InvariantDerivatives<V> d;
    const V psi = self().psi_and_slopes(I, d);
    V f = V(2.0) * d.d1;
    Mat3<V> cubic;
    if constexpr (Self::uses_I2) {
      f += V(2.0) * d.d2 * I.I1;
      cubic = F * transpose_times(F, F);
    }
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        P(i, j) = f * F(i, j) + d.dJ * G(i, j);
        if constexpr (Self::uses_I2) P(i, j) -= V(2.0) * d.d2 * cubic(i, j);
      }
    return psi;
  }

  // psi; d receives d1, d2 and dJ at least. A material may have a shorter way.
  V psi_and_slopes(const Invariants<V>& I, InvariantDerivatives<V>& d) const {
    d = self().derivatives(I);
    return self().psi(I);
  }

  Stiffness9<V> stiffness(const Mat3<V>& F) const {
    const Mat3<V> G = cofactor(F);
    const Invariants<V> I = invariants(F, G);
    const InvariantDerivatives<V> d = self().derivatives(I);
    Stiffness9<V> C;
    const V ff = V(4.0) * (Self::uses_I2 ? d.d11 + d.d2 : d.d11), fG = V(2.0) * d.d1J, diagonal = V(2.0) * d.d1;
    for (int p = 0; p < 9; ++p)
      for (int q = 0; q <= p; ++q) {
        const int i = p / 3, k = p % 3, j = q / 3, l = q % 3;
        V c = ff * F(i, k) * F(j, l) + fG * (F(i, k) * G(j, l) + G(i, k) * F(j, l)) + d.dJJ * G(i, k) * G(j, l);
        if (p == q) c += diagonal;
        if (i != j && k != l) {  // d2J / dF_ik dF_jl = e_ijm e_kln F_mn
          const V f = d.dJ * F(3 - i - j, 3 - k - l);
          const bool even = ((j - i + 3) % 3 == 1) == ((l - k + 3) % 3 == 1);
          c = even ? c + f : c - f;
        }
        C(p, q) = c;
      }
    if constexpr (Self::uses_I2) add_second_invariant(F, G, I, d, C);
    return C;
  }

  // psi_i = 2 psi_1 s_i + 2 psi_2 s_i (s_j^2 + s_k^2) + psi_J s_j s_k, from which sums and differences over
  // s_i + s_j and s_i - s_j divide out.
  Spectrum<V> spectrum(const Vec3<V>& s) const {
    const Vec3<V> q = {s[0] * s[0], s[1] * s[1], s[2] * s[2]};
    const Invariants<V> I = {q[0] + q[1] + q[2], q[0] * q[1] + q[1] * q[2] + q[2] * q[0], s[0] * s[1] * s[2]};
    const InvariantDerivatives<V> d = self().derivatives(I);
    Spectrum<V> H;
    Vec3<V> e1, e2, eJ;  // derivatives of the invariants
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      e1[i] = V(2.0) * s[i];
      e2[i] = V(2.0) * s[i] * (q[j] + q[k]);
      eJ[i] = s[j] * s[k];
      H.twist[i] = V(2.0) * d.d1 + V(2.0) * d.d2 * (q[i] + eJ[i]) + d.dJ * s[i];
      H.flip[i] = V(2.0) * d.d1 + V(2.0) * d.d2 * (q[i] - eJ[i]) - d.dJ * s[i];
    }
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j <= i; ++j) {
        V a = d.d11 * e1[i] * e1[j] + d.d22 * e2[i] * e2[j] + d.dJJ * eJ[i] * eJ[j] +
              d.d12 * (e1[i] * e2[j] + e2[i] * e1[j]) + d.d1J * (e1[i] * eJ[j] + eJ[i] * e1[j]) +
              d.d2J * (e2[i] * eJ[j] + eJ[i] * e2[j]);
        if (i == j) a += V(2.0) * d.d1 + V(2.0) * d.d2 * (I.I1 - q[i]);
        if (i != j) a += V(4.0) * d.d2 * s[i] * s[j] + d.dJ * s[3 - i - j];
        H.scaling(i, j) = H.scaling(j, i) = a;
      }
    return H;
  }

 private:
  const Self& self() const { return static_cast<const Self&>(*this); }

  static Invariants<V> invariants(const Mat3<V>& F, const Mat3<V>& G) {
    return {contract(F, F), Self::uses_I2 ? contract(G, G) : V(0.0), dot(column(F, 0), column(G, 0))};
  }

  // The terms of I2: with K = dI2/dF = 2 (I1 F - F F^T F),
  // d2I2 = 4 F x F + 2 I1 1 - 2 (d_ij C_kl + F_il F_jk + (F F^T)_ij d_kl); its 4 F x F is in `stiffness`.
  static void add_second_invariant(const Mat3<V>& F, const Mat3<V>& G, const Invariants<V>& I,
                                   const InvariantDerivatives<V>& d, Stiffness9<V>& C) {
    const Mat3<V> right = transpose_times(F, F), cubic = F * right;
    Mat3<V> left, K;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        left(i, j) = F(i, 0) * F(j, 0) + F(i, 1) * F(j, 1) + F(i, 2) * F(j, 2);
        K(i, j) = V(2.0) * (I.I1 * F(i, j) - cubic(i, j));
      }
    const V twice = V(2.0) * d.d2;
    for (int p = 0; p < 9; ++p)
      for (int q = 0; q <= p; ++q) {
        const int i = p / 3, k = p % 3, j = q / 3, l = q % 3;
        V c = d.d22 * K(i, k) * K(j, l) + V(2.0) * d.d12 * (F(i, k) * K(j, l) + K(i, k) * F(j, l)) +
              d.d2J * (G(i, k) * K(j, l) + K(i, k) * G(j, l)) - twice * F(i, l) * F(j, k);
        if (p == q) c += twice * I.I1;
        if (i == j) c -= twice * right(k, l);
        if (k == l) c -= twice * left(i, j);
        C(p, q) += c;
      }
  }
};

}  // namespace qlb
