#include "linalg/dense_cholesky.hpp"

#include <algorithm>
#include <utility>
#include <vector>

namespace qlb {

template <class T>
DenseCholesky<T>::DenseCholesky(const std::string& simd) : kernels_(find_dense_kernels<T>(simd)) {}

template <class T>
void DenseCholesky<T>::resize(std::int64_t size, std::int64_t positive) {
  size_ = size, positive_ = positive;
  ld_ = (size + 7) / 8 * 8 + 8;  // seldom a power of two, which the cache would not like
  matrix_.resize(ld_ * size + kPadding + ld_);
  side_.resize(size + kPadding);
  work_.resize(kWorkEntries);
  std::fill(matrix_.begin(), matrix_.end(), T(0));
}

template <class T>
template <class F>
void DenseCholesky<T>::for_each_panel(const F& f) const {
  for (std::int64_t j = 0; j < size_;) {
    const std::int64_t end = std::min(j + kWide, j < positive_ ? positive_ : size_);
    f(j, end);
    j = end;
  }
}

// Columns [j, j + width) minus L of columns [first, first + depth) times b^T, b the rows from j on of those columns.
template <class T>
void DenseCholesky<T>::subtract_product(std::int64_t j, std::int64_t width, const T* b, std::int64_t first,
                                        std::int64_t depth) {
  if (depth == 0) return;
  T* block = column(j) + j;
  const T* from = column(first) + j;
  for (std::int64_t i = 0; i < size_ - j; i += kTask)
    kernels_.subtract(block + i, ld_, from + i, b, ld_, std::min<std::int64_t>(kTask, size_ - j - i), width, depth,
                      i == 0, false, work_.data());
}

// Of the columns of -1 the factor L22 is that of -S22 + L21 L21^T.
template <class T>
void DenseCholesky<T>::subtract_left(std::int64_t j, std::int64_t width) {
  if (j < positive_) return subtract_product(j, width, column(0) + j, 0, j);
  negated_.resize(ld_ * positive_ + kPadding + ld_);
  for (std::int64_t k = 0; k < positive_; ++k)
    for (std::int64_t i = 0; i < width; ++i) negated_[i + k * ld_] = -column(k)[j + i];
  subtract_product(j, width, negated_.data(), 0, positive_);
  subtract_product(j, width, column(positive_) + j, positive_, j - positive_);
}

template <class T>
bool DenseCholesky<T>::factorise() {
  for (std::int64_t j = positive_; j < size_; ++j)
    for (std::int64_t i = j; i < size_; ++i) column(j)[i] = -column(j)[i];
  bool good = true;
  for_each_panel([&](std::int64_t j, std::int64_t end) {
    if (!good) return;
    subtract_left(j, end - j);
    good = kernels_.factor(column(j) + j, ld_, end - j, end - j) < 0;
    for (std::int64_t i = end; i < size_ && good; i += kTask)
      kernels_.solve_rows(column(j) + j, ld_, end - j, column(j) + i, ld_, std::min<std::int64_t>(kTask, size_ - i),
                          work_.data());
  });
  return good;
}

template <class T>
void DenseCholesky<T>::solve(double* b) {
  T* x = side_.data();
  const std::int64_t n = size_, ldx = n + kPadding;
  std::transform(b, b + n, x, [](double value) { return static_cast<T>(value); });
  std::fill_n(x + n, kPadding, T(0));
  std::vector<std::pair<std::int64_t, std::int64_t>> panels;
  for_each_panel([&](std::int64_t j, std::int64_t end) { panels.emplace_back(j, end); });
  for (const auto& [j, end] : panels) {
    kernels_.forward_own(matrix_.data(), ld_, j, end, x, ldx, 1);
    kernels_.forward_below(matrix_.data(), ld_, j, end, end, n, x, ldx, 1);
  }
  for (std::int64_t k = positive_; k < n; ++k) x[k] = -x[k];
  for (auto panel = panels.rbegin(); panel != panels.rend(); ++panel) {
    const auto [j, end] = *panel;
    kernels_.backward_above(matrix_.data(), ld_, n, j, end, end, x, ldx, 1);
    kernels_.backward_own(matrix_.data(), ld_, j, end, x, ldx, 1);
  }
  std::copy_n(x, n, b);
}

template class DenseCholesky<float>;
template class DenseCholesky<double>;

}  // namespace qlb
