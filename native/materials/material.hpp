// What a material is to the element kernels.
//
// A material M<V> sees the deformation gradient F of V::size elements at once and nothing of the mesh:
//
//   static constexpr const char* name            its short name, as in a scene file
//   static constexpr int parameter_count         doubles per element, in the order its Python class gives
//   them M(const V* parameters)                       reads them V energy(F) psi [Pa], zero at rest Mat3<V>
//   stress(F)                            first Piola-Kirchhoff stress dpsi/dF [Pa] Stiffness9<V> stiffness(F)
//   d2psi/dF2, exact [Pa] Spectrum<V> spectrum(sigma)                  the same in the frame of the SVD
//   (isotropic materials)
//
// Stiffness and spectrum are written down independently; a test holds one against the other.
#pragma once

#include <xsimd/xsimd.hpp>

#include "simd/mat3.hpp"

namespace qlb {

// d2psi / dF_ik dF_jl at [3 i + k][3 j + l]; symmetric, filled whole.
template <class V>
struct Stiffness9 {
  V c[9][9];
};

// The Hessian of an isotropic energy in the frame U E_ij R^T of the SVD (Smith, de Goes, Kim 2019, section
// 4): a 3x3 matrix over the singular values, and for each pair (i, j), stored at the index k that is left
// out, the eigenvalues of the twist (E_ij - E_ji)/sqrt 2 and of the flip (E_ij + E_ji)/sqrt 2.
template <class V>
struct Spectrum {
  Mat3<V> scaling;
  Vec3<V> twist, flip;
};

}  // namespace qlb
