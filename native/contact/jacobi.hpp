// Eigenvalues and eigenvectors of a small symmetric matrix by cyclic Jacobi rotations (Golub, Van Loan 2013, section
// 8.5).
#pragma once

#include <array>
#include <cmath>

namespace qlb {

template <int n>
using Square = std::array<std::array<double, n>, n>;

namespace detail {

// Makes A(p, q) zero. The rows of `vectors` turn along.
template <int n>
void jacobi_rotate(Square<n>& A, Square<n>& vectors, int p, int q) {
  const double theta = (A[q][q] - A[p][p]) / (2.0 * A[p][q]);
  const double t = std::copysign(1.0, theta) / (std::abs(theta) + std::sqrt(theta * theta + 1.0));
  const double c = 1.0 / std::sqrt(t * t + 1.0), s = t * c, change = t * A[p][q];
  const double pp = A[p][p] - change, qq = A[q][q] + change;
  for (int k = 0; k < n; ++k) {
    const double a = A[p][k], b = A[q][k], v = vectors[p][k], w = vectors[q][k];
    A[p][k] = c * a - s * b;
    A[q][k] = s * a + c * b;
    vectors[p][k] = c * v - s * w;
    vectors[q][k] = s * v + c * w;
  }
  for (int k = 0; k < n; ++k) {
    A[k][p] = A[p][k];
    A[k][q] = A[q][k];
  }
  A[p][p] = pp;
  A[q][q] = qq;
  A[p][q] = A[q][p] = 0.0;
}

}  // namespace detail

// Leaves the eigenvalues on the diagonal of A and the eigenvectors in the rows of `vectors`.
template <int n>
void jacobi_eigen(Square<n>& A, Square<n>& vectors) {
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) vectors[i][j] = i == j;
  for (int sweep = 0; sweep < 30; ++sweep) {
    double off = 0.0, all = 0.0;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        all += A[i][j] * A[i][j];
        if (i != j) off += A[i][j] * A[i][j];
      }
    if (!(off > 1e-28 * all)) return;
    for (int p = 0; p < n; ++p)
      for (int q = p + 1; q < n; ++q)
        if (A[p][q] * A[p][q] > 1e-30 / (n * n) * all) detail::jacobi_rotate<n>(A, vectors, p, q);
  }
}

}  // namespace qlb
