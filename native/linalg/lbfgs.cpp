#include "linalg/lbfgs.hpp"

#include <algorithm>
#include <cmath>

#include "linalg/vector_ops.hpp"

namespace qlb {

Lbfgs::Lbfgs(std::int64_t size, int window, int threads)
    : size_(size),
      window_(std::max(window, 1)),
      threads_(threads),
      pairs_(2 * static_cast<std::size_t>(window_ + 1) * size),
      curvature_(window_ + 1),
      alpha_(window_),
      work_(size) {}

bool Lbfgs::push(const double* x_old, const double* x, const double* g_old, const double* g) {
  double *s_new = s(count_), *y_new = y(count_);
  for (std::int64_t k = 0; k < size_; ++k) {
    s_new[k] = x[k] - x_old[k];
    y_new[k] = g[k] - g_old[k];
  }
  const double sy = dot(s_new, y_new, size_, threads_);
  const double ss = dot(s_new, s_new, size_, threads_), yy = dot(y_new, y_new, size_, threads_);
  if (!(sy > 1e-12 * std::sqrt(ss * yy))) return false;
  curvature_[slot(count_)] = sy;
  if (count_ == window_)
    first_ = (first_ + 1) % (window_ + 1);
  else
    ++count_;
  return true;
}

double Lbfgs::direction(const double* g, InverseOperator& inner, double* p) {
  std::copy(g, g + size_, work_.data());
  for (int k = count_ - 1; k >= 0; --k) {
    alpha_[k] = dot(s(k), work_.data(), size_, threads_) / curvature_[slot(k)];
    add_scaled(-alpha_[k], y(k), work_.data(), size_, threads_);
  }
  inner.apply(work_.data(), p);
  for (int k = 0; k < count_; ++k) {
    const double beta = dot(y(k), p, size_, threads_) / curvature_[slot(k)];
    add_scaled(alpha_[k] - beta, s(k), p, size_, threads_);
  }
  for (std::int64_t k = 0; k < size_; ++k) p[k] = -p[k];
  return dot(g, p, size_, threads_);
}

}  // namespace qlb
