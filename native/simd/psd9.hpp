// The nearest positive semidefinite matrix to a symmetric 9x9 one, one matrix per lane, by cyclic Jacobi
// (Golub, Van Loan 2013, section 8.5).
#pragma once

#include "materials/material.hpp"
#include "simd/svd3.hpp"

namespace qlb {
namespace detail {

template <class V>
struct Eigen9 {
  V A[9][9], Q[9][9];  // A diagonal on return, the eigenvectors the columns of Q

  explicit Eigen9(const Stiffness9<V>& C) {
    for (int p = 0; p < 9; ++p)
      for (int q = 0; q < 9; ++q) {
        A[p][q] = C(p, q);
        Q[p][q] = V(p == q ? 1.0 : 0.0);
      }
    for (int sweep = 0; sweep < 12 && !diagonal(); ++sweep)
      for (int p = 0; p < 8; ++p)
        for (int q = p + 1; q < 9; ++q) rotate(p, q);
  }

 private:
  bool diagonal() const {
    V off(0.0), on(0.0);
    for (int p = 0; p < 9; ++p) {
      on += A[p][p] * A[p][p];
      for (int q = 0; q < p; ++q) off += A[p][q] * A[p][q];
    }
    return xsimd::all(off <= V(1e-32) * on);
  }

  // The angle is that of jacobi_rotate in svd3.hpp.
  void rotate(int p, int q) {
    const V b = A[p][q] + A[p][q], d = A[q][q] - A[p][p];
    const auto done = b * b < V(kTiny);
    const V inverse = inverse_sqrt(xsimd::max(d * d + b * b, V(kTiny)));
    const V cc = where(done, V(1.0), V(0.5) + V(0.5) * xsimd::abs(d) * inverse);
    const V inverse_c = inverse_sqrt(cc), c = cc * inverse_c;
    const V half = V(0.5) * b * inverse * inverse_c;
    const V s = where(done, V(0.0), where(d < V(0.0), -half, half));
    for (int r = 0; r < 9; ++r) turn(c, s, A[r][p], A[r][q]);
    for (int r = 0; r < 9; ++r) turn(c, s, A[p][r], A[q][r]);
    for (int r = 0; r < 9; ++r) turn(c, s, Q[r][p], Q[r][q]);
  }

  static void turn(const V& c, const V& s, V& a, V& b) {
    const V old = a;
    a = c * old - s * b;
    b = s * old + c * b;
  }
};

// Whether C + 1e-13 tr(C) 1 has a Cholesky factor in every lane: C is positive semidefinite to rounding.
template <class V>
bool all_semidefinite(const Stiffness9<V>& C) {
  V L[9][9], trace(0.0);
  for (int p = 0; p < 9; ++p) trace += xsimd::abs(C(p, p));
  for (int p = 0; p < 9; ++p)
    for (int q = 0; q <= p; ++q) {
      V sum = C(p, q);
      if (p == q) sum += V(1e-13) * trace;
      for (int r = 0; r < q; ++r) sum -= L[p][r] * L[q][r];
      if (p != q) {
        L[p][q] = sum * L[q][q];
        continue;
      }
      if (!xsimd::all(sum > V(0.0))) return false;
      L[p][p] = inverse_sqrt(sum);
    }
  return true;
}

}  // namespace detail

// C itself where all lanes are positive semidefinite to rounding.
template <class V>
Stiffness9<V> project_psd(Stiffness9<V> C) {
  if (detail::all_semidefinite(C)) return C;
  const detail::Eigen9<V> eigen(C);
  for (int k = 0; k < 9; ++k) {
    const V negative = xsimd::min(eigen.A[k][k], V(0.0));
    if (xsimd::all(negative == V(0.0))) continue;
    for (int p = 0; p < 9; ++p)
      for (int q = 0; q <= p; ++q) C(p, q) -= negative * eigen.Q[p][k] * eigen.Q[q][k];
  }
  return C;
}

}  // namespace qlb
