// Our own supernodal Cholesky: analysed once, factorised and solved in float or double.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "linalg/cholesky.hpp"
#include "linalg/node_columns.hpp"
#include "linalg/supernodal_factor.hpp"

namespace qlb {

// compact: in float, and solves for one vector read a copy of L in 16 bits.
enum class Precision { compact, float32, float64 };

// With P the permutation to elimination order, restricted to the free degrees of freedom: P A P^T = L L^T. Vectors
// outside are double, whatever the precision of L and of the substitutions.
class SupernodalCholesky : public Cholesky {
 public:
  // fixed: (nodes, 3), nonzero where held. simd: a level of simd_levels(), or "" for the best.
  // node_order: all nodes in the order of elimination, or empty for nested dissection.
  SupernodalCholesky(std::shared_ptr<const BlockPattern> pattern, std::span<const std::uint8_t> fixed, int threads,
                     Precision precision, const std::string& simd = "", std::span<const std::int32_t> node_order = {});

  // Goes on in another precision; the factor in place is lost.
  void set_precision(Precision precision);
  Precision precision() const { return precision_; }

  std::int64_t size() const override { return 3 * pattern_->nodes(); }
  std::int64_t rows() const { return static_cast<std::int64_t>(supernodes_.dof.size()); }
  std::int64_t factorise(const BlockMatrix& matrix) override;
  void apply(const double* b, double* x) override { solve(b, x, 1); }
  void solve(const double* b, double* x, std::int64_t count);  // both (count, size)

  // y = L^-1 P b and x = P^T L^-T y; y in elimination order, rows() long.
  void forward(const double* b, double* y);
  void backward(const double* y, double* x);

  // L^-1 P b for b zero but at some degrees of freedom; held ones are ignored, repeated ones add up. The result is
  // zero but in `row`, which are the columns of all supernodes from those of b up to the root.
  struct Sparse {
    std::vector<std::int64_t> row;
    std::vector<double> value;
  };
  Sparse forward_sparse(std::span<const std::int64_t> dof, std::span<const double> value);

  // x = P^T L^-T f(L^-1 P b), f(T* y, double scale) changing scale y in place, in elimination order and in the
  // precision of the factor; scale is a power of two.
  template <class F>
  void solve_with(const double* b, double* x, const F& f);

  // What changes whenever the factor does.
  std::int64_t version() const { return version_; }
  void check_ready() const;
  // Calls f(const SupernodalFactor<T>&) for the precision at hand.
  template <class F>
  auto visit_factor(const F& f) const {
    return std::visit([&](const auto& numeric) { return f(std::as_const(numeric->factor)); }, numeric_);
  }
  template <class T>
  std::unique_ptr<NodeColumns<T>> make_columns(int threads) const {
    const SupernodalFactor<T>& factor = std::get<std::unique_ptr<Numeric<T>>>(numeric_)->factor;
    return std::make_unique<NodeColumns<T>>(supernodes_, factor, row_of_dof_, owner_, threads);
  }

  std::span<const std::int32_t> node_order() const { return node_order_; }  // all nodes; those wholly held come last
  std::span<const std::int64_t> order() const { return supernodes_.dof; }   // degree of freedom of each row
  std::int64_t factor_nonzeros() const override { return nonzeros_; }
  double factor_flops() const override { return flops_; }
  std::int64_t bytes() const;        // that L takes
  std::int64_t solve_bytes() const;  // of L that a solve reads

 private:
  template <class T>
  struct Numeric {
    SupernodalFactor<T> factor;
    HugeBuffer<T> y;             // right-hand sides in elimination order
    std::vector<T> sparse_work;  // zeros
  };
  using AnyNumeric = std::variant<std::unique_ptr<Numeric<float>>, std::unique_ptr<Numeric<double>>>;

  std::vector<std::int32_t> path_to_root(std::span<const std::int64_t> dof) const;
  // Right-hand sides to elimination order and back, divided by and times a scale; returns the scale.
  template <class T>
  double take(const double* b, T* y) const;
  template <class T>
  void give(const T* y, double scale, double* x) const;
  template <class T>
  void solve_sides(Numeric<T>& numeric, const double* b, double* x, int used, int sides);

  std::shared_ptr<const BlockPattern> pattern_;
  std::vector<std::int32_t> node_order_;
  Supernodes supernodes_;
  std::vector<std::int32_t> row_of_dof_, owner_;  // -1 where held; supernode of each row
  std::int64_t nonzeros_ = 0;
  double flops_ = 0.0;
  int threads_;
  std::string simd_;
  Precision precision_ = Precision::float64;
  bool ready_ = false;
  std::int64_t version_ = 0;
  AnyNumeric numeric_;
};

template <class F>
void SupernodalCholesky::solve_with(const double* b, double* x, const F& f) {
  check_ready();
  std::visit(
      [&](auto& numeric) {
        auto* y = numeric->y.data();
        const double scale = take(b, y);
        numeric->factor.forward(y, rows(), 1);
        f(y, scale);
        numeric->factor.backward(y, rows(), 1);
        give(y, scale, x);
      },
      numeric_);
}

}  // namespace qlb
