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

void Lbfgs::choose_terms(const RankOneTerms& terms, std::span<const double> known, std::span<const double> beta) {
  terms.check_nodes(size_ / 3);
  which_.clear();
  known_.clear();
  beta_.clear();
  for (std::int64_t j = 0; j < terms.size(); ++j) {
    const double stiffness = known[j], force = beta.empty() ? 0.0 : beta[j];
    if (stiffness < 0.0)
      throw std::invalid_argument("stiffness of term " + std::to_string(j) + " is " + std::to_string(stiffness) +
                                  ", expected at least 0");
    if (stiffness == 0.0 && force == 0.0) continue;
    which_.push_back(static_cast<std::int32_t>(j));
    known_.push_back(stiffness);
    beta_.push_back(force);
  }
}

void Lbfgs::join_terms(const RankOneTerms& terms) {
  const auto count = static_cast<std::int64_t>(which_.size());
  with_terms_.resize(count_);
  along_s_.resize(count_ * count);
  change_.resize(count_ * count);
  for (int k = 0; k < count_; ++k) {
    with_terms_[k] = curvature_[slot(k)];
    double *along = along_s_.data() + k * count, *change = change_.data() + k * count;
    for (std::int64_t j = 0; j < count; ++j) {
      along[j] = terms.dot(which_[j], s(k));
      change[j] = known_[j] * along[j];
    }
    with_terms_[k] += dot(along, change, count, 1);
  }
}

double Lbfgs::direction_with(const double* g, std::span<const double> beta, InverseOperator& inner,
                             const RankOneTerms& terms, double* p, std::span<const double> known) {
  choose_terms(terms, known.empty() ? terms.all_stiffness() : known, beta);
  join_terms(terms);
  const auto count = static_cast<std::int64_t>(which_.size());
  forces_ = beta_;
  along_.resize(count);
  const auto few_dot = [&](const double* a, const double* b) { return dot(a, b, count, 1); };
  const auto few_add = [&](double scale, const double* a, std::vector<double>& to) {
    add_scaled(scale, a, to.data(), count, 1);
  };

  std::copy(g, g + size_, work_.data());
  for (int k = count_ - 1; k >= 0; --k) {
    const double *along = along_s_.data() + k * count, *change = change_.data() + k * count;
    alpha_[k] = (dot(s(k), work_.data(), size_, threads_) + few_dot(along, beta_.data())) / with_terms_[k];
    add_scaled(-alpha_[k], y(k), work_.data(), size_, threads_);
    few_add(-alpha_[k], change, beta_);
  }
  if (count == 0)
    inner.apply(work_.data(), p);
  else
    inner.apply_split(work_.data(), terms, which_, beta_.data(), p, along_.data());
  for (int k = 0; k < count_; ++k) {
    const double *along = along_s_.data() + k * count, *change = change_.data() + k * count;
    const double weight = alpha_[k] - (dot(y(k), p, size_, threads_) + few_dot(change, along_.data())) / with_terms_[k];
    add_scaled(weight, s(k), p, size_, threads_);
    few_add(weight, along, along_);
  }
  for (std::int64_t k = 0; k < size_; ++k) p[k] = -p[k];
  return dot(g, p, size_, threads_) - few_dot(forces_.data(), along_.data());
}

}  // namespace qlb
