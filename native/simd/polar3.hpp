// The rotation nearest to F, one matrix per lane.
//
// Scaled Newton (Higham 1986), which needs no eigenvalues, where F is well away from singular in every lane;
// else the rotation-variant SVD, R = U V^T, which is the nearest rotation also for inverted F.
#pragma once

#include "simd/svd3.hpp"

namespace qlb {

template <class V>
Mat3<V> nearest_rotation_newton(Mat3<V> X) {
  for (int k = 0; k < 10; ++k) {
    const Mat3<V> G = cofactor(X);
    const V inverse = V(1.0) / dot(column(X, 0), column(G, 0));
    V a(0.5), b = V(0.5) * inverse;
    if (k == 0) {  // brings the singular values around 1; later the iteration converges quadratically by itself
      const V gamma = xsimd::sqrt(xsimd::sqrt(contract(G, G) * inverse * inverse / contract(X, X)));
      a *= gamma;
      b = b / gamma;
    }
    V change(0.0);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        const V next = a * X(i, j) + b * G(i, j);
        const V d = next - X(i, j);
        change += d * d;
        X(i, j) = next;
      }
    if (xsimd::all(change < V(1e-17))) break;  // the next change would be of the order of rounding
  }
  return X;
}

template <class V>
Mat3<V> nearest_rotation(const Mat3<V>& F) {
  const V size = contract(F, F);
  if (xsimd::all(determinant(F) > V(1e-3) * size * xsimd::sqrt(size))) return nearest_rotation_newton(F);
  const Svd3<V> svd = svd3(F);
  Mat3<V> R;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      R(i, j) = svd.U(i, 0) * svd.R(j, 0) + svd.U(i, 1) * svd.R(j, 1) + svd.U(i, 2) * svd.R(j, 2);
  return R;
}

}  // namespace qlb
