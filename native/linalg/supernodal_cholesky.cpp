#include "linalg/supernodal_cholesky.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "linalg/ordering.hpp"

namespace qlb {
namespace {

std::vector<std::int32_t> checked_order(const BlockPattern& pattern, std::span<const std::uint8_t> fixed,
                                        std::span<const std::int32_t> given) {
  const std::int64_t nodes = pattern.nodes();
  if (static_cast<std::int64_t>(fixed.size()) != 3 * nodes)
    throw std::invalid_argument("fixed must have one entry per degree of freedom");
  if (given.empty()) return nested_dissection(pattern, fixed);
  if (static_cast<std::int64_t>(given.size()) != nodes)
    throw std::invalid_argument("order has " + std::to_string(given.size()) + " nodes, expected all " +
                                std::to_string(nodes));
  std::vector<std::uint8_t> seen(nodes, 0);
  for (const std::int32_t node : given) {
    if (node < 0 || node >= nodes || seen[node])
      throw std::invalid_argument("order holds node " + std::to_string(node) + " twice or outside [0, " +
                                  std::to_string(nodes) + ")");
    seen[node] = 1;
  }
  return {given.begin(), given.end()};
}

// The power of two nearest above the largest entry: a right-hand side divided by it cannot overflow or vanish in float.
double power_above(const double* b, std::int64_t size) {
  double largest = 0.0;
  for (std::int64_t k = 0; k < size; ++k) largest = std::max(largest, std::abs(b[k]));
  int exponent = 0;
  if (std::isfinite(largest)) std::frexp(largest, &exponent);
  return std::ldexp(1.0, std::clamp(exponent, -1000, 1000));
}

}  // namespace

SupernodalCholesky::SupernodalCholesky(std::shared_ptr<const BlockPattern> pattern, std::span<const std::uint8_t> fixed,
                                       int threads, Precision precision, const std::string& simd,
                                       std::span<const std::int32_t> node_order)
    : pattern_(std::move(pattern)),
      node_order_(checked_order(*pattern_, fixed, node_order)),
      supernodes_(find_supernodes(*pattern_, fixed, node_order_)),
      threads_(std::max(threads, 1)),
      simd_(simd) {
  row_of_dof_.assign(size(), -1);
  for (std::int64_t k = 0; k < rows(); ++k) row_of_dof_[supernodes_.dof[k]] = static_cast<std::int32_t>(k);
  owner_.resize(rows());
  for (std::int32_t s = 0; s < supernodes_.count(); ++s) {
    std::fill(owner_.begin() + supernodes_.first[s], owner_.begin() + supernodes_.first[s + 1], s);
    nonzeros_ += supernodes_.nonzeros(s);
    flops_ += supernodes_.flops(s);
  }
  set_precision(precision);
}

void SupernodalCholesky::set_precision(Precision precision) {
  ready_ = false;
  ++version_;
  precision_ = precision;
  const bool compact = precision == Precision::compact;
  const auto make = [&]<class T>(T) {
    numeric_ = std::unique_ptr<Numeric<T>>(
        new Numeric<T>{SupernodalFactor<T>(supernodes_, *pattern_, threads_, simd_, compact),
                       HugeBuffer<T>(kRightSides * rows()), std::vector<T>(rows())});
  };
  if (precision == Precision::float64)
    make(double{});
  else
    make(float{});
}

std::int64_t SupernodalCholesky::bytes() const {
  return std::visit([](const auto& numeric) { return numeric->factor.bytes(); }, numeric_);
}

std::int64_t SupernodalCholesky::solve_bytes() const {
  return std::visit(
      [&]<class N>(const std::unique_ptr<N>& numeric) -> std::int64_t {
        const std::int64_t compact = numeric->factor.compact_bytes();
        return 2 * (compact > 0 ? compact : nonzeros_ * static_cast<std::int64_t>(sizeof(*numeric->y.data())));
      },
      numeric_);
}

std::int64_t SupernodalCholesky::factorise(const BlockMatrix& matrix) {
  if (&matrix.pattern() != pattern_.get())
    throw std::invalid_argument("the matrix has another pattern than the factor");
  ++version_;
  const std::int64_t column =
      std::visit([&](auto& numeric) { return numeric->factor.factorise(matrix.values()); }, numeric_);
  ready_ = column < 0;
  return ready_ ? kPositiveDefinite : supernodes_.dof[column];
}

void SupernodalCholesky::check_ready() const {
  if (!ready_) throw std::logic_error("solve without a factor: factorise first");
}

template <class T>
double SupernodalCholesky::take(const double* b, T* y) const {
  const double scale = power_above(b, size()), inverse = 1.0 / scale;
  for (std::int64_t k = 0; k < rows(); ++k) y[k] = static_cast<T>(inverse * b[supernodes_.dof[k]]);
  return scale;
}

template <class T>
void SupernodalCholesky::give(const T* y, double scale, double* x) const {
  std::fill(x, x + size(), 0.0);
  for (std::int64_t k = 0; k < rows(); ++k) x[supernodes_.dof[k]] = scale * y[k];
}

template double SupernodalCholesky::take(const double*, float*) const;
template double SupernodalCholesky::take(const double*, double*) const;
template void SupernodalCholesky::give(const float*, double, double*) const;
template void SupernodalCholesky::give(const double*, double, double*) const;

template <class T>
void SupernodalCholesky::solve_sides(Numeric<T>& numeric, const double* b, double* x, int used, int sides) {
  const std::int64_t n = rows();
  T* y = numeric.y.data();
  double scale[kRightSides];
  for (int r = 0; r < used; ++r) scale[r] = take(b + r * size(), y + r * n);
  std::fill(y + used * n, y + sides * n, T(0));
  numeric.factor.solve(y, n, sides);
  for (int r = 0; r < used; ++r) give(y + r * n, scale[r], x + r * size());
}

void SupernodalCholesky::solve(const double* b, double* x, std::int64_t count) {
  check_ready();
  for (std::int64_t r = 0; r < count;) {
    const auto used = static_cast<int>(std::min<std::int64_t>(count - r, kRightSides));
    std::visit(
        [&](auto& numeric) {
          solve_sides(*numeric, b + r * size(), x + r * size(), used, used == 1 ? 1 : kRightSides);
        },
        numeric_);
    r += used;
  }
}

void SupernodalCholesky::forward(const double* b, double* y) {
  check_ready();
  const auto run = [&](auto& numeric) {
    for (std::int64_t k = 0; k < rows(); ++k) numeric->y.data()[k] = b[supernodes_.dof[k]];
    numeric->factor.forward(numeric->y.data(), rows(), 1);
    std::copy_n(numeric->y.data(), rows(), y);
  };
  std::visit(run, numeric_);
}

void SupernodalCholesky::backward(const double* y, double* x) {
  check_ready();
  const auto run = [&](auto& numeric) {
    std::copy_n(y, rows(), numeric->y.data());
    numeric->factor.backward(numeric->y.data(), rows(), 1);
    std::fill(x, x + size(), 0.0);
    for (std::int64_t k = 0; k < rows(); ++k) x[supernodes_.dof[k]] = numeric->y.data()[k];
  };
  std::visit(run, numeric_);
}

std::vector<std::int32_t> SupernodalCholesky::path_to_root(std::span<const std::int64_t> dof) const {
  std::vector<std::int32_t> path;
  std::vector<std::uint8_t> seen(supernodes_.count(), 0);
  for (const std::int64_t d : dof) {
    if (d < 0 || d >= size()) throw std::out_of_range("degree of freedom " + std::to_string(d) + " does not exist");
    if (row_of_dof_[d] < 0) continue;
    for (std::int32_t s = owner_[row_of_dof_[d]]; s >= 0 && !seen[s]; s = supernodes_.parent[s])
      seen[s] = 1, path.push_back(s);
  }
  std::sort(path.begin(), path.end());
  return path;
}

SupernodalCholesky::Sparse SupernodalCholesky::forward_sparse(std::span<const std::int64_t> dof,
                                                              std::span<const double> value) {
  check_ready();
  if (dof.size() != value.size()) throw std::invalid_argument("one value per degree of freedom is wanted");
  const std::vector<std::int32_t> path = path_to_root(dof);
  Sparse result;
  const auto run = [&]<class T>(std::unique_ptr<Numeric<T>>& numeric) {
    T* y = numeric->sparse_work.data();
    for (std::size_t k = 0; k < dof.size(); ++k)
      if (row_of_dof_[dof[k]] >= 0) y[row_of_dof_[dof[k]]] += static_cast<T>(value[k]);
    numeric->factor.forward_along(path, y);
    for (const std::int32_t s : path)
      for (std::int32_t k = supernodes_.first[s]; k < supernodes_.first[s + 1]; ++k) {
        result.row.push_back(k);
        result.value.push_back(y[k]);
        y[k] = T(0);
      }
  };
  std::visit(run, numeric_);
  return result;
}

}  // namespace qlb
