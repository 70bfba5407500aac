// Branch-free symmetric eigenvalues and rotation-variant SVD of 3x3 matrices, one matrix per lane.
//
// Jacobi on F^T F gives V; QR of F V by Givens rotations gives U and the signed singular values
// (McAdams, Selle, Tamstorf, Teran, Sifakis 2011). U and V are rotations; det F < 0 makes the last value
// negative.
#pragma once

#include <type_traits>
#include <xsimd/xsimd.hpp>

#include "simd/mat3.hpp"

namespace qlb {

template <class V>
struct Svd3 {
  Mat3<V> U, R;  // F = U diag(sigma) R^T
  Vec3<V> sigma;
};

namespace detail {

template <class V>
V where(const typename V::batch_bool_type& mask, const V& yes, const V& no) {
  return xsimd::select(mask, yes, no);
}

// 1/sqrt(x) to rounding, for positive x.
template <class V>
V inverse_sqrt(const V& x) {
#if defined(__AVX512F__)
  if constexpr (std::is_same_v<typename V::arch_type, xsimd::avx512f>) {
    V y(_mm512_rsqrt14_pd(x));  // 14 bits, then two Newton steps: several times cheaper than a root and a division
    y = y * (V(1.5) - V(0.5) * x * y * y);
    return y * (V(1.5) - V(0.5) * x * y * y);
  }
#endif
  return V(1.0) / xsimd::sqrt(x);
}

inline constexpr double kTiny = 1e-290;  // squares below are rounding noise of zero

// One Jacobi rotation that zeroes S(p, q); Q gathers the rotations. r is the index left over.
// With b = 2 S_pq, d = S_qq - S_pp: c^2 = (1 + |d|/|(d, b)|)/2, s = sign(d) b / (2 c |(d, b)|).
template <class V, int p, int q>
void jacobi_rotate(Mat3<V>& S, Mat3<V>& Q) {
  constexpr int r = 3 - p - q;
  const V b = S(p, q) + S(p, q);
  const V d = S(q, q) - S(p, p);
  const auto diagonal = b * b < V(kTiny);
  const V inverse = inverse_sqrt(xsimd::max(d * d + b * b, V(kTiny)));
  const V cc = where(diagonal, V(1.0), V(0.5) + V(0.5) * xsimd::abs(d) * inverse);
  const V inverse_c = inverse_sqrt(cc);
  const V c = cc * inverse_c;
  const V half = V(0.5) * b * inverse * inverse_c;
  const V s = where(diagonal, V(0.0), where(d < V(0.0), -half, half));
  const V t = s * inverse_c;
  const V Spq = S(p, q);
  S(p, p) -= t * Spq;
  S(q, q) += t * Spq;
  S(p, q) = S(q, p) = V(0.0);
  const V Srp = S(r, p), Srq = S(r, q);
  S(r, p) = S(p, r) = c * Srp - s * Srq;
  S(r, q) = S(q, r) = s * Srp + c * Srq;
  for (int i = 0; i < 3; ++i) {
    const V Qip = Q(i, p), Qiq = Q(i, q);
    Q(i, p) = c * Qip - s * Qiq;
    Q(i, q) = s * Qip + c * Qiq;
  }
}

// Exchange columns i and j of A where the mask holds, with one sign flipped so that rotations stay rotations.
template <class V, class Mask>
void swap_columns(const Mask& mask, Mat3<V>& A, int i, int j) {
  for (int k = 0; k < 3; ++k) {
    const V a = A(k, i), b = A(k, j);
    A(k, i) = where(mask, b, a);
    A(k, j) = where(mask, -a, b);
  }
}

// Givens rotation of rows p and q of B that zeroes B(q, column); U gathers its transpose.
template <class V>
void givens_rotate(Mat3<V>& B, Mat3<V>& U, int p, int q, int column) {
  const V a = B(p, column), b = B(q, column);
  const V square = a * a + b * b;
  const auto zero = square < V(kTiny);
  const V inverse = inverse_sqrt(xsimd::max(square, V(kTiny)));
  const V c = where(zero, V(1.0), a * inverse);
  const V s = where(zero, V(0.0), b * inverse);
  for (int k = 0; k < 3; ++k) {
    const V Bp = B(p, k), Bq = B(q, k);
    B(p, k) = c * Bp + s * Bq;
    B(q, k) = c * Bq - s * Bp;
    const V Up = U(k, p), Uq = U(k, q);
    U(k, p) = c * Up + s * Uq;
    U(k, q) = c * Uq - s * Up;
  }
}

}  // namespace detail

// Eigenvalues on the diagonal of S on return; the eigenvectors are the columns of the rotation returned.
// Convergence is quadratic; the loop ends when every lane is diagonal to rounding, or after 10 sweeps (NaN
// input).
template <class V>
Mat3<V> symmetric_eigen(Mat3<V>& S) {
  Mat3<V> Q = identity3<V>();
  for (int sweep = 0; sweep < 10; ++sweep) {
    const V off = S(0, 1) * S(0, 1) + S(0, 2) * S(0, 2) + S(1, 2) * S(1, 2);
    const V diagonal = S(0, 0) * S(0, 0) + S(1, 1) * S(1, 1) + S(2, 2) * S(2, 2);
    if (xsimd::all(off <= V(1e-34) * diagonal)) break;
    detail::jacobi_rotate<V, 0, 1>(S, Q);
    detail::jacobi_rotate<V, 0, 2>(S, Q);
    detail::jacobi_rotate<V, 1, 2>(S, Q);
  }
  return Q;
}

template <class V>
Svd3<V> svd3(const Mat3<V>& F) {
  Svd3<V> svd;
  Mat3<V> S = transpose_times(F, F);
  svd.R = symmetric_eigen(S);
  Mat3<V> B = F * svd.R;
  // Longest column first, so that QR loses nothing to a column that is only rounding noise.
  constexpr int pairs[3][2] = {{0, 1}, {0, 2}, {1, 2}};
  for (const auto& [i, j] : pairs) {
    const auto swap = dot(column(B, i), column(B, i)) < dot(column(B, j), column(B, j));
    detail::swap_columns(swap, B, i, j);
    detail::swap_columns(swap, svd.R, i, j);
  }
  svd.U = identity3<V>();
  detail::givens_rotate(B, svd.U, 0, 1, 0);
  detail::givens_rotate(B, svd.U, 0, 2, 0);
  detail::givens_rotate(B, svd.U, 1, 2, 1);
  for (int i = 0; i < 3; ++i) svd.sigma[i] = B(i, i);
  return svd;
}

// The nearest positive semidefinite matrix in the Frobenius norm; A itself, to the bit, where all lanes are positive
// definite already (by Sylvester's criterion).
template <class V>
Mat3<V> project_psd(Mat3<V> A) {
  const V minor = A(0, 0) * A(1, 1) - A(0, 1) * A(0, 1);
  if (xsimd::all((A(0, 0) > V(0.0)) & (minor > V(0.0)) & (determinant(A) > V(0.0)))) return A;
  const Mat3<V> Q = symmetric_eigen(A);
  Mat3<V> P;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j <= i; ++j) {
      V sum(0.0);
      for (int k = 0; k < 3; ++k) sum += Q(i, k) * xsimd::max(A(k, k), V(0.0)) * Q(j, k);
      P(i, j) = P(j, i) = sum;
    }
  return P;
}

}  // namespace qlb
