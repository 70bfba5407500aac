// 3-vectors and 3x3 matrices whose entries are scalars or SIMD vectors: one element per lane.
#pragma once

#include <array>

namespace qlb {

template <class V>
using Vec3 = std::array<V, 3>;

template <class V>
struct Mat3 {
  V m[3][3];
  V& operator()(int i, int j) { return m[i][j]; }
  const V& operator()(int i, int j) const { return m[i][j]; }
};

template <class V>
V dot(const Vec3<V>& a, const Vec3<V>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

template <class V>
Vec3<V> cross(const Vec3<V>& a, const Vec3<V>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

template <class V>
Vec3<V> column(const Mat3<V>& A, int j) {
  return {A(0, j), A(1, j), A(2, j)};
}

template <class V>
void set_column(Mat3<V>& A, int j, const Vec3<V>& a) {
  for (int i = 0; i < 3; ++i) A(i, j) = a[i];
}

template <class V>
Mat3<V> operator*(const Mat3<V>& A, const Mat3<V>& B) {
  Mat3<V> C;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) C(i, j) = A(i, 0) * B(0, j) + A(i, 1) * B(1, j) + A(i, 2) * B(2, j);
  return C;
}

// A^T B
template <class V>
Mat3<V> transpose_times(const Mat3<V>& A, const Mat3<V>& B) {
  Mat3<V> C;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) C(i, j) = A(0, i) * B(0, j) + A(1, i) * B(1, j) + A(2, i) * B(2, j);
  return C;
}

// A^T a
template <class V>
Vec3<V> transpose_times(const Mat3<V>& A, const Vec3<V>& a) {
  return {dot(column(A, 0), a), dot(column(A, 1), a), dot(column(A, 2), a)};
}

// sum_ij A_ij B_ij
template <class V>
V contract(const Mat3<V>& A, const Mat3<V>& B) {
  V sum = A(0, 0) * B(0, 0);
  for (int k = 1; k < 9; ++k) sum += A(k / 3, k % 3) * B(k / 3, k % 3);
  return sum;
}

// The cofactor matrix, dJ/dF: its columns are the cross products of the columns of F.
template <class V>
Mat3<V> cofactor(const Mat3<V>& F) {
  Mat3<V> G;
  set_column(G, 0, cross(column(F, 1), column(F, 2)));
  set_column(G, 1, cross(column(F, 2), column(F, 0)));
  set_column(G, 2, cross(column(F, 0), column(F, 1)));
  return G;
}

template <class V>
V determinant(const Mat3<V>& F) {
  return dot(column(F, 0), cross(column(F, 1), column(F, 2)));
}

template <class V>
Mat3<V> identity3() {
  Mat3<V> I;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) I(i, j) = V(i == j ? 1.0 : 0.0);
  return I;
}

}  // namespace qlb
