// Energies of the distance to the nearest rotation R:
//   ARAP (Sorkine, Alexa 2007):                psi = mu |F - R|^2
//   fixed corotational (Stomakhin et al. 2012): psi = mu |F - R|^2 + lambda/2 (J - 1)^2
// Where singular values add up to zero R is not unique, and the Hessian is not defined.
#pragma once

#include "materials/material.hpp"
#include "simd/polar3.hpp"

namespace qlb {

template <class V, bool kVolume>
struct CorotationalBase {
  static constexpr HessianForm hessian_form = HessianForm::kSpectrum;

  V mu, lambda;

  V energy(const Mat3<V>& F) const {
    Mat3<V> P;
    return energy_stress(F, P);
  }

  V energy_stress(const Mat3<V>& F, Mat3<V>& P) const {
    const Mat3<V> R = nearest_rotation(F);
    V psi(0.0);
    for (int k = 0; k < 9; ++k) {
      const V d = F(k / 3, k % 3) - R(k / 3, k % 3);
      psi += mu * d * d;
      P(k / 3, k % 3) = V(2.0) * mu * d;
    }
    if constexpr (kVolume) {
      const Mat3<V> G = cofactor(F);
      const V change = dot(column(F, 0), column(G, 0)) - V(1.0);
      psi += V(0.5) * lambda * change * change;
      for (int k = 0; k < 9; ++k) P(k / 3, k % 3) += lambda * change * G(k / 3, k % 3);
    }
    return psi;
  }

  Spectrum<V> spectrum(const Vec3<V>& s) const {
    const V pressure = kVolume ? lambda * (s[0] * s[1] * s[2] - V(1.0)) : V(0.0);
    const Vec3<V> g = {s[1] * s[2], s[2] * s[0], s[0] * s[1]};
    Spectrum<V> H;
    for (int i = 0; i < 3; ++i) {
      H.twist[i] = V(2.0) * mu - V(4.0) * mu / (s[(i + 1) % 3] + s[(i + 2) % 3]) + pressure * s[i];
      H.flip[i] = V(2.0) * mu - pressure * s[i];
      for (int j = 0; j < 3; ++j) {
        H.scaling(i, j) = kVolume ? lambda * g[i] * g[j] : V(0.0);
        H.scaling(i, j) += i == j ? V(2.0) * mu : pressure * s[3 - i - j];
      }
    }
    return H;
  }
};

template <class V>
struct Arap : CorotationalBase<V, false> {
  static constexpr const char* name = "ARAP";
  static constexpr int parameter_count = 1;
  explicit Arap(const V* parameters) : CorotationalBase<V, false>{parameters[0], V(0.0)} {}
};

template <class V>
struct FixedCorotational : CorotationalBase<V, true> {
  static constexpr const char* name = "corotational";
  static constexpr int parameter_count = 2;
  explicit FixedCorotational(const V* parameters) : CorotationalBase<V, true>{parameters[0], parameters[1]} {}
};

QLB_MATERIAL(FixedCorotational);
QLB_MATERIAL(Arap);

}  // namespace qlb
