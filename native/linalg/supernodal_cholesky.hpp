// Our own supernodal Cholesky: analysed once, factorised and solved in float or double.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "linalg/cholesky.hpp"
#include "linalg/supernodal_factor.hpp"

namespace qlb {

enum class Precision { float32, float64 };

// With P the permutation to elimination order, restricted to the free degrees of freedom: P A P^T = L L^T. Vectors
// outside are double, whatever the precision of L and of the substitutions.
class SupernodalCholesky : public Cholesky {
 public:
  // fixed: (nodes, 3), nonzero where held. simd: a level of simd_levels(), or "" for the best.
  SupernodalCholesky(std::shared_ptr<const BlockPattern> pattern, std::span<const std::uint8_t> fixed, int threads,
                     Precision precision, const std::string& simd = "");

  // Goes on in another precision; the factor in place is lost.
  void set_precision(Precision precision);

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

  std::span<const std::int64_t> order() const { return supernodes_.dof; }  // degree of freedom of each row
  std::int64_t factor_nonzeros() const override { return nonzeros_; }
  double factor_flops() const override { return flops_; }
  std::int64_t bytes() const;                                                 // that L takes
  std::int64_t solve_bytes() const { return 2 * nonzeros_ * entry_bytes(); }  // of L that a solve reads

 private:
  template <class T>
  struct Numeric {
    SupernodalFactor<T> factor;
    HugeBuffer<T> y;             // right-hand sides in elimination order
    std::vector<T> sparse_work;  // zeros
  };
  using AnyNumeric = std::variant<std::unique_ptr<Numeric<float>>, std::unique_ptr<Numeric<double>>>;

  std::int64_t entry_bytes() const { return std::holds_alternative<std::unique_ptr<Numeric<float>>>(numeric_) ? 4 : 8; }
  void check_ready() const;
  std::vector<std::int32_t> path_to_root(std::span<const std::int64_t> dof) const;
  template <class T>
  void solve_sides(Numeric<T>& numeric, const double* b, double* x, int used, int sides);

  std::shared_ptr<const BlockPattern> pattern_;
  Supernodes supernodes_;
  std::vector<std::int32_t> row_of_dof_, owner_;  // -1 where held; supernode of each row
  std::int64_t nonzeros_ = 0;
  double flops_ = 0.0;
  int threads_;
  std::string simd_;
  bool ready_ = false;
  AnyNumeric numeric_;
};

}  // namespace qlb
