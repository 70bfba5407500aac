// What a material is to the element kernels.
//
// A material M<V> sees the deformation gradient F of V::size elements at once and nothing of the mesh:
//
//   static constexpr const char* name            its short name, as in a scene file
//   static constexpr int parameter_count         doubles per element, in the order its Python class gives
//   them static constexpr HessianForm hessian_form    which of the two forms below it has M(const V*
//   parameters)                       reads them V energy(F)                                  psi [Pa], zero
//   at rest; NaN where psi is not defined V energy_stress(F, P)                        the same, and P =
//   dpsi/dF, the first Piola-Kirchhoff stress [Pa] Stiffness9<V> stiffness(F)                   d2psi/dF2,
//   exact [Pa] Spectrum<V> spectrum(sigma)                  the same in the frame of the SVD (isotropic
//   materials)
//
// A material whose density is a program (materials/program.hpp) says so by `static constexpr bool takes_program =
// true`; it has no parameter_count, and M(const double* parameters, int stride, const Program&) reads the lanes itself.
//
// Where a material has both forms they are written down independently; a test holds one against the other.
//
// A header ends with QLB_MATERIAL(M); for each material in it. CMake writes the list of all of them, materials/all.hpp,
// from these lines.
#pragma once

#include <limits>
#include <xsimd/xsimd.hpp>

#include "simd/mat3.hpp"

// Makes M known to the element kernels (see above).
#define QLB_MATERIAL(M) static_assert(::qlb::is_material_template<M>)

namespace qlb {

template <template <class> class>
inline constexpr bool is_material_template = true;

enum class HessianForm {
  kStiffnessAndSpectrum,  // exact Hessians from stiffness(F), projected ones from spectrum(sigma)
  kSpectrum,              // both from spectrum(sigma)
  kStiffnessPair,         // exact from stiffness(F), projected from projected_stiffness(F)
  kConvexStiffness,       // stiffness(F) is positive semidefinite as it stands
};

template <class M>
inline constexpr bool takes_program = requires { M::takes_program; };

// d2psi / dF_ik dF_jl at (3 i + k, 3 j + l); symmetric, only the lower triangle is kept.
template <class V>
class Stiffness9 {
 public:
  V& operator()(int p, int q) { return p >= q ? lower_[p][q] : lower_[q][p]; }
  const V& operator()(int p, int q) const { return p >= q ? lower_[p][q] : lower_[q][p]; }

 private:
  V lower_[9][9];
};

// The Hessian of an isotropic energy in the frame U E_ij R^T of the SVD (Smith, de Goes, Kim 2019, section
// 4): a 3x3 matrix over the singular values, and for each pair (i, j), stored at the index k that is left
// out, the eigenvalues of the twist (E_ij - E_ji)/sqrt 2 and of the flip (E_ij + E_ji)/sqrt 2.
template <class V>
struct Spectrum {
  Mat3<V> scaling;
  Vec3<V> twist, flip;
};

// log x, NaN for x <= 0.
template <class V>
V log_or_nan(const V& x) {
  const V nan = V(std::numeric_limits<double>::quiet_NaN());
  return xsimd::select(x > V(0.0), xsimd::log(x), nan);
}

}  // namespace qlb
