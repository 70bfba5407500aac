// Dense factor S = L D L^T, D = diag(1, ..., 1, -1, ..., -1), of a symmetric matrix with that inertia.
//
// No pivots are needed where S11 (of the ones) and the negative of its Schur complement, S21 S11^-1 S12 - S22, are both
// positive definite: the matrix of a Woodbury formula whose sum is positive definite is like that.
#pragma once

#include <cstdint>
#include <string>

#include "linalg/dense_kernels.hpp"
#include "simd/aligned.hpp"

namespace qlb {

template <class T>  // float or double
class DenseCholesky {
 public:
  explicit DenseCholesky(const std::string& simd = "");

  // Room for a matrix whose first `positive` pivots are 1 and whose others are -1.
  void resize(std::int64_t size, std::int64_t positive);
  std::int64_t size() const { return size_; }
  T* column(std::int64_t j) { return matrix_.data() + j * ld_; }  // the lower triangle, by columns
  // False where the matrix is not as said above, or holds NaN.
  bool factorise();
  void solve(double* x);  // x := S^-1 x
  std::int64_t bytes() const { return static_cast<std::int64_t>(matrix_.size() * sizeof(T)); }

 private:
  void subtract_left(std::int64_t j, std::int64_t width);
  void subtract_product(std::int64_t j, std::int64_t width, const T* b, std::int64_t first, std::int64_t depth);
  // Calls f(begin, end) for each range of columns that is finished together.
  template <class F>
  void for_each_panel(const F& f) const;

  const DenseKernels<T>& kernels_;
  std::int64_t size_ = 0, positive_ = 0, ld_ = 0;
  Aligned<T> matrix_, negated_, work_, side_;
};

}  // namespace qlb
