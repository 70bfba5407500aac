// Energies of a fibre family with rest direction a, to be added to an isotropic material; with I5 = |F a|^2 and
// l = sqrt I5 (Kim, de Goes, Iben 2019):
//   sqrtI5:       psi = mu/2 (l - s)^2, s = the sign of I4 = a.S a, S the symmetric factor of F = R S: the
//                 sign-corrected model, which lets an inverted fibre come back the way it went
//   fibre-StVK:   psi = mu/2 (I5 - 1)^2
// Both depend on F through F a alone. So the Hessian is H (x) a a^T with a 3x3 matrix H that has one eigenvalue along
// n = F a/l and two equal ones across; each is clamped by itself.
#pragma once

#include "materials/material.hpp"
#include "simd/polar3.hpp"

namespace qlb {

// psi, its derivative over the length of the fibre divided by that length, and its second derivative.
template <class V>
struct FibreResponse {
  V psi, tension, along;
};

// Self supplies response(F, fibre).
template <class V, class Self>
struct FibreMaterial {
  static constexpr HessianForm hessian_form = HessianForm::kStiffnessPair;
  static constexpr int parameter_count = 4;

  V mu;
  Vec3<V> a;

  explicit FibreMaterial(const V* parameters) : mu(parameters[0]), a{parameters[1], parameters[2], parameters[3]} {}

  V energy(const Mat3<V>& F) const {
    const Fibre fibre(F, a);
    return self().response(F, fibre).psi;
  }

  V energy_stress(const Mat3<V>& F, Mat3<V>& P) const {
    const Fibre fibre(F, a);
    const FibreResponse<V> r = self().response(F, fibre);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) P(i, j) = r.tension * fibre.y[i] * a[j];
    return r.psi;
  }

  Stiffness9<V> stiffness(const Mat3<V>& F) const { return assemble(F, false); }
  Stiffness9<V> projected_stiffness(const Mat3<V>& F) const { return assemble(F, true); }

 protected:
  struct Fibre {
    Vec3<V> y;  // F a
    V length;
    Fibre(const Mat3<V>& F, const Vec3<V>& a) {
      for (int i = 0; i < 3; ++i) y[i] = F(i, 0) * a[0] + F(i, 1) * a[1] + F(i, 2) * a[2];
      length = xsimd::sqrt(dot(y, y));
    }
  };

 private:
  const Self& self() const { return static_cast<const Self&>(*this); }

  Stiffness9<V> assemble(const Mat3<V>& F, bool project) const {
    const Fibre fibre(F, a);
    const FibreResponse<V> r = self().response(F, fibre);
    const V across = project ? xsimd::max(r.tension, V(0.0)) : r.tension;
    const V along = project ? xsimd::max(r.along, V(0.0)) : r.along;
    const V inverse = V(1.0) / xsimd::max(dot(fibre.y, fibre.y), V(detail::kTiny));
    Stiffness9<V> C;
    for (int p = 0; p < 9; ++p)
      for (int q = 0; q <= p; ++q) {
        const int i = p / 3, j = q / 3;
        V h = (along - across) * inverse * fibre.y[i] * fibre.y[j];
        if (i == j) h += across;
        C(p, q) = h * a[p % 3] * a[q % 3];
      }
    return C;
  }
};

template <class V>
struct FibreSqrtI5 : FibreMaterial<V, FibreSqrtI5<V>> {
  static constexpr const char* name = "fibre-sqrtI5";
  using Base = FibreMaterial<V, FibreSqrtI5<V>>;
  using Base::Base;

  FibreResponse<V> response(const Mat3<V>& F, const typename Base::Fibre& fibre) const {
    const V stretch = fibre.length - sign(F, fibre.y);
    return {V(0.5) * this->mu * stretch * stretch, this->mu * stretch / xsimd::max(fibre.length, V(detail::kTiny)),
            this->mu};
  }

 private:
  // S is positive definite where det F > 0; only elsewhere is R needed: a.S a = (R a).(F a).
  V sign(const Mat3<V>& F, const Vec3<V>& y) const {
    if (xsimd::all(determinant(F) > V(0.0))) return V(1.0);
    const Mat3<V> R = nearest_rotation(F);
    V I4(0.0);
    for (int i = 0; i < 3; ++i) I4 += (R(i, 0) * this->a[0] + R(i, 1) * this->a[1] + R(i, 2) * this->a[2]) * y[i];
    return detail::where(I4 < V(0.0), V(-1.0), V(1.0));
  }
};

template <class V>
struct FibreStVK : FibreMaterial<V, FibreStVK<V>> {
  static constexpr const char* name = "fibre-StVK";
  using Base = FibreMaterial<V, FibreStVK<V>>;
  using Base::Base;

  FibreResponse<V> response(const Mat3<V>&, const typename Base::Fibre& fibre) const {
    const V I5 = fibre.length * fibre.length;
    const V tension = V(2.0) * this->mu * (I5 - V(1.0));
    return {V(0.5) * this->mu * (I5 - V(1.0)) * (I5 - V(1.0)), tension, tension + V(4.0) * this->mu * I5};
  }
};

QLB_MATERIAL(FibreSqrtI5);
QLB_MATERIAL(FibreStVK);

}  // namespace qlb
