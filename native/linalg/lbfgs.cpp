#include "linalg/lbfgs.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

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

void Lbfgs::take_terms(const RankOneTerms& terms) {
  terms.check_nodes(size_ / 3);
  const std::int64_t count = terms.size();
  with_terms_.resize(count_);
  term_changes_.resize(count_ * count);
  for (int k = 0; k < count_; ++k) {
    with_terms_[k] = curvature_[slot(k)];
    for (std::int64_t j = 0; j < count; ++j) {
      const double along = terms.dot(j, s(k));
      term_changes_[k * count + j] = terms.stiffness(j) * along;
      with_terms_[k] += terms.stiffness(j) * along * along;
    }
  }
}

double Lbfgs::dot_y(int k, const RankOneTerms& terms, const double* v) {
  double sum = dot(y(k), v, size_, threads_);
  for (std::int64_t j = 0; j < terms.size(); ++j) sum += term_changes_[k * terms.size() + j] * terms.dot(j, v);
  return sum;
}

void Lbfgs::add_y(int k, const RankOneTerms& terms, double scale, double* v) {
  add_scaled(scale, y(k), v, size_, threads_);
  for (std::int64_t j = 0; j < terms.size(); ++j) terms.add(j, scale * term_changes_[k * terms.size() + j], v);
}

double Lbfgs::direction_with(const double* g, InverseOperator& inner, const RankOneTerms& terms, double* p) {
  for (std::int64_t j = 0; j < terms.size(); ++j)
    if (terms.stiffness(j) < 0.0)
      throw std::invalid_argument("stiffness of term " + std::to_string(j) + " is " +
                                  std::to_string(terms.stiffness(j)) + ", expected at least 0");
  take_terms(terms);
  std::copy(g, g + size_, work_.data());
  for (int k = count_ - 1; k >= 0; --k) {
    alpha_[k] = dot(s(k), work_.data(), size_, threads_) / with_terms_[k];
    add_y(k, terms, -alpha_[k], work_.data());
  }
  inner.apply(work_.data(), p);
  for (int k = 0; k < count_; ++k) {
    const double beta = dot_y(k, terms, p) / with_terms_[k];
    add_scaled(alpha_[k] - beta, s(k), p, size_, threads_);
  }
  for (std::int64_t k = 0; k < size_; ++k) p[k] = -p[k];
  return dot(g, p, size_, threads_);
}

}  // namespace qlb
