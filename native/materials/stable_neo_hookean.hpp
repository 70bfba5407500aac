// Stable Neo-Hookean (Smith, de Goes, Kim 2018, eq. 14):
//   psi = mu/2 (I_C - 3) + lambda/2 (J - alpha)^2 - mu/2 log(I_C + 1),  alpha = 1 + mu/lambda - mu/(4 lambda)
// less its value at rest. mu and lambda are the reparametrised constants of their section 3.4.
#pragma once

#include "materials/material.hpp"

namespace qlb {

template <class V>
struct StableNeoHookean {
  static constexpr const char* name = "SNH";
  static constexpr int parameter_count = 2;

  V mu, lambda, alpha;

  explicit StableNeoHookean(const V* parameters)
      : mu(parameters[0]), lambda(parameters[1]), alpha(V(1.0) + V(0.75) * mu / lambda) {}

  // The factor of F in the stress: mu (1 - 1/(I_C + 1)).
  V shear(const V& IC) const { return mu - mu / (IC + V(1.0)); }

  // log(4) and (1 - alpha)^2 are the values at rest.
  V energy(const Mat3<V>& F) const {
    const V IC = contract(F, F);
    const V dJ = dot(column(F, 0), column(cofactor(F), 0)) - alpha;
    const V rest = V(1.0) - alpha;
    return V(0.5) *
           (mu * (IC - V(3.0) - xsimd::log(V(0.25) * (IC + V(1.0)))) + lambda * (dJ * dJ - rest * rest));
  }

  Mat3<V> stress(const Mat3<V>& F) const {
    const Mat3<V> G = cofactor(F);
    const V a = shear(contract(F, F));
    const V b = lambda * (dot(column(F, 0), column(G, 0)) - alpha);
    Mat3<V> P;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) P(i, j) = a * F(i, j) + b * G(i, j);
    return P;
  }

  Stiffness9<V> stiffness(const Mat3<V>& F) const {
    const Mat3<V> G = cofactor(F);
    const V IC = contract(F, F);
    const V a = shear(IC);
    const V b = V(2.0) * mu / ((IC + V(1.0)) * (IC + V(1.0)));
    const V s = lambda * (dot(column(F, 0), column(G, 0)) - alpha);
    Stiffness9<V> C;
    for (int p = 0; p < 9; ++p)
      for (int q = 0; q <= p; ++q) {
        const int i = p / 3, k = p % 3, j = q / 3, l = q % 3;
        V value = b * F(i, k) * F(j, l) + lambda * G(i, k) * G(j, l);
        if (p == q) value += a;
        if (i != j && k != l) {
          // d2J / dF_ik dF_jl = e_ijm e_kln F_mn
          const V f = s * F(3 - i - j, 3 - k - l);
          const bool even = ((j - i + 3) % 3 == 1) == ((l - k + 3) % 3 == 1);
          value = even ? value + f : value - f;
        }
        C.c[p][q] = C.c[q][p] = value;
      }
    return C;
  }

  Spectrum<V> spectrum(const Vec3<V>& sigma) const {
    const V IC = dot(sigma, sigma);
    const V J = sigma[0] * sigma[1] * sigma[2];
    const V a = shear(IC);
    const V b = V(2.0) * mu / ((IC + V(1.0)) * (IC + V(1.0)));
    const V s = lambda * (J - alpha);
    const Vec3<V> g = {sigma[1] * sigma[2], sigma[2] * sigma[0], sigma[0] * sigma[1]};
    Spectrum<V> H;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        H.scaling(i, j) = b * sigma[i] * sigma[j] + lambda * g[i] * g[j];
        if (i == j) H.scaling(i, j) += a;
        if (i != j) H.scaling(i, j) += s * sigma[3 - i - j];
      }
      H.twist[i] = a + s * sigma[i];
      H.flip[i] = a - s * sigma[i];
    }
    return H;
  }
};

}  // namespace qlb
