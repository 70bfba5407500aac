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

RankOneTerms::RankOneTerms(std::span<const std::int32_t> nodes, std::span<const double> gamma,
                           std::span<const double> axis, std::span<const double> stiffness)
    : nodes_(stiffness.size()),
      gamma_(stiffness.size()),
      axis_(stiffness.size()),
      stiffness_(stiffness.begin(), stiffness.end()) {
  const std::size_t count = stiffness.size();
  check_size(nodes.size(), 4 * count, "nodes");
  check_size(gamma.size(), 4 * count, "gamma");
  check_size(axis.size(), 3 * count, "axis");
  check_finite(gamma, 4, "gamma");
  check_finite(axis, 3, "axis");
  check_finite(stiffness, 1, "stiffness");
  for (std::size_t j = 0; j < count; ++j) {
    std::copy_n(nodes.begin() + 4 * j, 4, nodes_[j].begin());
    std::copy_n(gamma.begin() + 4 * j, 4, gamma_[j].begin());
    std::copy_n(axis.begin() + 3 * j, 3, axis_[j].begin());
    for (const std::int32_t node : nodes_[j]) {
      if (node < 0)
        throw std::invalid_argument("term " + std::to_string(j) + " has node " + std::to_string(node) +
                                    ", expected at least 0");
      last_node_ = std::max(last_node_, node);
    }
  }
}

void RankOneTerms::check_nodes(std::int64_t nodes) const {
  if (last_node_ >= nodes)
    throw std::invalid_argument("a term has node " + std::to_string(last_node_) + ", outside [0, " +
                                std::to_string(nodes) + ")");
}

double RankOneTerms::dot(std::int64_t j, const double* v) const {
  const std::array<double, 3>& n = axis_[j];
  double sum = 0.0;
  for (int i = 0; i < 4; ++i) {
    const double* at = v + 3 * static_cast<std::int64_t>(nodes_[j][i]);
    sum += gamma_[j][i] * (n[0] * at[0] + n[1] * at[1] + n[2] * at[2]);
  }
  return sum;
}

void RankOneTerms::add(std::int64_t j, double scale, double* out) const {
  for (int i = 0; i < 4; ++i)
    for (int c = 0; c < 3; ++c)
      out[3 * static_cast<std::int64_t>(nodes_[j][i]) + c] += scale * gamma_[j][i] * axis_[j][c];
}

void RankOneTerms::add_product(const double* v, double* out, double scale) const {
  for (std::int64_t j = 0; j < size(); ++j) add(j, scale * stiffness_[j] * dot(j, v), out);
}

void RankOneTerms::add_combination(std::span<const double> beta, double* out) const {
  for (std::int64_t j = 0; j < size(); ++j) add(j, beta[j], out);
}

}  // namespace qlb
