// The rotation nearest to F, one matrix per lane.
//
// The trace f of the stretch tensor is the largest root of a quartic in the invariants of F, and the rotation is df/dF
// (Lin, Chitalu, Komura 2022). That needs no eigenvectors and is used where F is well away from singular in every lane;
// else the rotation-variant SVD, R = U V^T, which is the nearest rotation also for inverted F.
#pragma once

#include "simd/svd3.hpp"

namespace qlb {

// f = s0 + s1 + s2: f^4 - 2 I1 f^2 - 8 J f + I1^2 - 4 I2 = 0, by Newton from above, sqrt(3 I1) >= f.
template <class V>
V stretch_trace(const V& I1, const V& I2, const V& J) {
  V f = xsimd::sqrt(V(3.0) * I1);
  const V constant = I1 * I1 - V(4.0) * I2;
  for (int k = 0; k < 20; ++k) {
    const V square = f * f;
    const V value = (square - V(2.0) * I1) * square - V(8.0) * J * f + constant;
    const V change = value / (V(4.0) * (f * (square - I1) - V(2.0) * J));
    f -= change;
    if (xsimd::all(change * change < V(1e-17) * square)) break;  // the next change would be rounding
  }
  return f;
}

// R = df/dF = ((f^2 + I1) F + 2 f cof F - 2 F F^T F)/(f^3 - I1 f - 2 J), for det F > 0.
template <class V>
Mat3<V> rotation_from_trace(const Mat3<V>& F) {
  const Mat3<V> G = cofactor(F), cubic = F * transpose_times(F, F);
  const V I1 = contract(F, F), J = dot(column(F, 0), column(G, 0));
  const V f = stretch_trace(I1, contract(G, G), J);
  const V inverse = V(1.0) / (f * (f * f - I1) - V(2.0) * J);
  const V a = (f * f + I1) * inverse, b = V(2.0) * f * inverse, c = V(2.0) * inverse;
  Mat3<V> R;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) R(i, j) = a * F(i, j) + b * G(i, j) - c * cubic(i, j);
  return R;
}

template <class V>
Mat3<V> nearest_rotation(const Mat3<V>& F) {
  const V size = contract(F, F);
  if (xsimd::all(determinant(F) > V(1e-3) * size * xsimd::sqrt(size))) return rotation_from_trace(F);
  const Svd3<V> svd = svd3(F);
  Mat3<V> R;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      R(i, j) = svd.U(i, 0) * svd.R(j, 0) + svd.U(i, 1) * svd.R(j, 1) + svd.U(i, 2) * svd.R(j, 2);
  return R;
}

}  // namespace qlb
