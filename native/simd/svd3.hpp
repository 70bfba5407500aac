// Branch-free symmetric eigenvalues and rotation-variant SVD of 3x3 matrices, one matrix per lane.
//
// Jacobi on F^T F gives V; QR of F V by Givens rotations gives U and the signed singular values
// (McAdams, Selle, Tamstorf, Teran, Sifakis 2011). U and V are rotations; det F < 0 makes the last value
// negative.
#pragma once

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

// One Jacobi rotation that zeroes S(p, q); Q gathers the rotations. r is the index left over.
template <class V, int p, int q>
void jacobi_rotate(Mat3<V>& S, Mat3<V>& Q) {
  constexpr int r = 3 - p - q;
  const V b = S(p, q) + S(p, q);
  const V d = S(q, q) - S(p, p);
  const V root = xsimd::sqrt(d * d + b * b);
  const V sign = where(d < V(0.0), V(-1.0), V(1.0));
  const V denominator = xsimd::abs(d) + root;
  const auto zero = denominator == V(0.0);
  const V t = sign * b / where(zero, V(1.0), denominator);
  const V c = V(1.0) / xsimd::sqrt(V(1.0) + t * t);
  const V s = t * c;
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
  const V rho = xsimd::sqrt(a * a + b * b);
  const auto zero = rho == V(0.0);
  const V inverse = V(1.0) / where(zero, V(1.0), rho);
  const V c = where(zero, V(1.0), a * inverse);
  const V s = b * inverse;
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

// The nearest positive semidefinite matrix in the Frobenius norm.
template <class V>
Mat3<V> project_psd(Mat3<V> A) {
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
