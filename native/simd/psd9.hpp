// The nearest positive semidefinite matrix to a symmetric 9x9 one, one matrix per lane, by one-sided Jacobi
// (Hestenes 1958; Golub, Van Loan 2013, section 8.6.3).
#pragma once

#include "materials/material.hpp"
#include "simd/svd3.hpp"

namespace qlb {
namespace detail {

// Turns the columns of G = C/scale + shift 1, which is positive definite with a condition of at most nine, until they
// are orthogonal: then they are eigenvectors of C, as long as their eigenvalues of G. There is no second matrix to
// keep, and the four rotations of a round wait for none of each other.
template <class V>
struct Eigen9 {
  V G[9][9];  // G[p] is column p
  V scale, shift;
  V square[9];  // |G[p]|^2

  explicit Eigen9(const Stiffness9<V>& C) {
    scale = V(kTiny);
    for (int p = 0; p < 9; ++p)
      for (int q = 0; q <= p; ++q) scale = xsimd::max(scale, xsimd::abs(C(p, q)));
    V norm(0.0);
    for (int p = 0; p < 9; ++p)
      for (int q = 0; q < 9; ++q) {
        G[p][q] = C(p, q) / scale;
        norm += G[p][q] * G[p][q];
      }
    shift = V(1.25) * xsimd::sqrt(xsimd::max(norm, V(1.0)));
    for (int p = 0; p < 9; ++p) G[p][p] += shift;
    for (int sweep = 0; sweep < 12 && !orthogonal(); ++sweep) {
      for (int p = 0; p < 9; ++p) square[p] = dot(G[p], G[p]);
      for (int round = 0; round < 9; ++round)  // the pairs with p + q = 2 round mod 9
        for (int k = 1; k <= 4; ++k) rotate((round + k) % 9, (round + 9 - k) % 9);
    }
  }

  static V dot(const V* a, const V* b) {
    V even = a[0] * b[0] + a[2] * b[2], odd = a[1] * b[1] + a[3] * b[3];
    for (int r = 4; r < 8; r += 2) {
      even += a[r] * b[r];
      odd += a[r + 1] * b[r + 1];
    }
    return even + odd + a[8] * b[8];
  }

 private:
  bool orthogonal() const {
    V off(0.0);
    for (int p = 1; p < 9; ++p)
      for (int q = 0; q < p; ++q) {
        const V product = dot(G[p], G[q]);
        off += product * product;
      }
    const V square = shift * shift;
    return xsimd::all(off <= V(1e-28) * square * square);
  }

  // The angle is that of jacobi_rotate in svd3.hpp, for the matrix of the inner products.
  void rotate(int p, int q) {
    V *a = G[p], *b = G[q];
    const V product = dot(a, b), twice = product + product, d = square[q] - square[p];
    const auto done = twice * twice < V(kTiny);
    const V inverse = inverse_sqrt(xsimd::max(d * d + twice * twice, V(kTiny)));
    const V cc = where(done, V(1.0), V(0.5) + V(0.5) * xsimd::abs(d) * inverse);
    const V inverse_c = inverse_sqrt(cc), c = cc * inverse_c;
    const V half = V(0.5) * twice * inverse * inverse_c;
    const V s = where(done, V(0.0), where(d < V(0.0), -half, half));
    const V change = s * inverse_c * product;
    square[p] -= change;
    square[q] += change;
    for (int r = 0; r < 9; ++r) {
      const V old = a[r];
      a[r] = c * old - s * b[r];
      b[r] = s * old + c * b[r];
    }
  }
};

// Whether C + 1e-13 tr|C| 1 has a Cholesky factor in every lane: C is positive semidefinite to rounding.
template <class V>
bool all_semidefinite(const Stiffness9<V>& C) {
  V L[9][9], trace(0.0);
  for (int p = 0; p < 9; ++p) trace += xsimd::abs(C(p, p));
  for (int p = 0; p < 9; ++p)
    for (int q = 0; q <= p; ++q) {
      V sum = C(p, q);
      if (p == q) sum += V(1e-13) * trace + V(kTiny);
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

// C itself where all lanes are positive semidefinite to rounding; NaN where C is not finite.
template <class V>
Stiffness9<V> project_psd(Stiffness9<V> C) {
  if (detail::all_semidefinite(C)) return C;
  const detail::Eigen9<V> eigen(C);
  for (int k = 0; k < 9; ++k) {
    const V* vector = eigen.G[k];
    const V square = eigen.dot(vector, vector), value = xsimd::sqrt(square) - eigen.shift;
    const V negative = xsimd::min(value, V(0.0)) * eigen.scale / square;
    if (xsimd::all(value >= V(0.0))) continue;
    for (int p = 0; p < 9; ++p)
      for (int q = 0; q <= p; ++q) C(p, q) -= negative * vector[p] * vector[q];
  }
  return C;
}

}  // namespace qlb
