#include "linalg/rank_one_terms.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace qlb {
namespace {

void check_size(std::size_t size, std::size_t expected, const char* name) {
  if (size != expected)
    throw std::invalid_argument(std::string(name) + " has " + std::to_string(size) + " entries, expected " +
                                std::to_string(expected));
}

void check_finite(std::span<const double> values, std::size_t width, const char* name) {
  const auto bad = std::find_if(values.begin(), values.end(), [](double v) { return !std::isfinite(v); });
  if (bad != values.end())
    throw std::invalid_argument(std::string(name) + " of term " + std::to_string((bad - values.begin()) / width) +
                                " is " + std::to_string(*bad) + ", not a finite number");
}

}  // namespace

void RankOneTerms::take(std::span<const std::int32_t> nodes, std::span<const double> stiffness) {
  const std::size_t count = stiffness.size();
  check_size(nodes.size(), 4 * count, "nodes");
  check_finite(stiffness, 1, "stiffness");
  stiffness_.assign(stiffness.begin(), stiffness.end());
  nodes_.resize(count);
  vector_.resize(count);
  for (std::size_t j = 0; j < count; ++j) {
    std::copy_n(nodes.begin() + 4 * j, 4, nodes_[j].begin());
    for (const std::int32_t node : nodes_[j]) {
      if (node < 0)
        throw std::invalid_argument("term " + std::to_string(j) + " has node " + std::to_string(node) +
                                    ", expected at least 0");
      last_node_ = std::max(last_node_, node);
    }
  }
}

RankOneTerms::RankOneTerms(std::span<const std::int32_t> nodes, std::span<const double> gamma,
                           std::span<const double> axis, std::span<const double> stiffness) {
  const std::size_t count = stiffness.size();
  check_size(gamma.size(), 4 * count, "gamma");
  check_size(axis.size(), 3 * count, "axis");
  check_finite(gamma, 4, "gamma");
  check_finite(axis, 3, "axis");
  take(nodes, stiffness);
  for (std::size_t j = 0; j < count; ++j)
    for (int k = 0; k < 12; ++k) vector_[j][k] = gamma[4 * j + k / 3] * axis[3 * j + k % 3];
}

RankOneTerms::RankOneTerms(std::span<const std::int32_t> nodes, std::span<const double> vectors,
                           std::span<const double> stiffness) {
  check_size(vectors.size(), 12 * stiffness.size(), "vectors");
  check_finite(vectors, 12, "vectors");
  take(nodes, stiffness);
  for (std::size_t j = 0; j < stiffness.size(); ++j) std::copy_n(vectors.begin() + 12 * j, 12, vector_[j].begin());
}

void RankOneTerms::reserve(std::int64_t count) {
  nodes_.reserve(count);
  vector_.reserve(count);
  stiffness_.reserve(count);
}

void RankOneTerms::add(const std::array<std::int32_t, 4>& nodes, const std::array<double, 12>& vector,
                       double stiffness) {
  nodes_.push_back(nodes);
  vector_.push_back(vector);
  stiffness_.push_back(stiffness);
  last_node_ = std::max(last_node_, *std::ranges::max_element(nodes));
}

void RankOneTerms::add(const std::array<std::int32_t, 4>& nodes, const std::array<double, 4>& gamma,
                       const std::array<double, 3>& axis, double stiffness) {
  std::array<double, 12> vector;
  for (int k = 0; k < 12; ++k) vector[k] = gamma[k / 3] * axis[k % 3];
  add(nodes, vector, stiffness);
}

void RankOneTerms::add(const RankOneTerms& others) {
  nodes_.insert(nodes_.end(), others.nodes_.begin(), others.nodes_.end());
  vector_.insert(vector_.end(), others.vector_.begin(), others.vector_.end());
  stiffness_.insert(stiffness_.end(), others.stiffness_.begin(), others.stiffness_.end());
  last_node_ = std::max(last_node_, others.last_node_);
}

void RankOneTerms::check_nodes(std::int64_t nodes) const {
  if (last_node_ >= nodes)
    throw std::invalid_argument("a term has node " + std::to_string(last_node_) + ", outside [0, " +
                                std::to_string(nodes) + ")");
}

void RankOneTerms::add_to(std::int64_t j, double scale, double* out) const {
  for (int i = 0; i < 4; ++i)
    for (int c = 0; c < 3; ++c) out[3 * static_cast<std::int64_t>(nodes_[j][i]) + c] += scale * vector_[j][3 * i + c];
}

void RankOneTerms::add_product(const double* v, double* out, double scale, std::span<const double> stiffness) const {
  for (std::int64_t j = 0; j < size(); ++j)
    if (stiffness[j] != 0.0) add_to(j, scale * stiffness[j] * dot(j, v), out);
}

void RankOneTerms::add_combination(std::span<const double> beta, double* out) const {
  for (std::int64_t j = 0; j < size(); ++j)
    if (beta[j] != 0.0) add_to(j, beta[j], out);
}

}  // namespace qlb
