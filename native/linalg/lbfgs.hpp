// Limited-memory BFGS around an inner inverse (Nocedal, Wright 2006, algorithm 7.4).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "linalg/cholesky.hpp"
#include "linalg/rank_one_terms.hpp"
#include "simd/aligned.hpp"

namespace qlb {

class Lbfgs {
 public:
  Lbfgs(std::int64_t size, int window, int threads);

  void clear() { count_ = 0; }
  int pairs() const { return count_; }
  // Stores s = x - x_old, y = g - g_old; skipped (false) where s.y <= 1e-12 |s||y|: the curvature must be
  // positive.
  bool push(const double* x_old, const double* x, const double* g_old, const double* g);
  // p = -H g, H the quasi-Newton inverse over `inner`. Returns g.p, the slope along p.
  double direction(const double* g, InverseOperator& inner, double* p) { return direction_with(g, {}, inner, {}, p); }
  // The same for g + C beta, with y + C K C^T s in place of each y, for terms that do not take away (structured
  // quasi-Newton: what the pairs hold is the change of the gradient without these terms, and their Hessian of the
  // moment is known). Vectors in the span of C are kept apart by their coefficients all the way: next to stiff terms
  // the solves of a float32 factor would leave nothing of the rest. beta: one per term, or none. known: stiffness of
  // the terms in the pairs, zero for what the pairs hold themselves; that of the terms if empty.
  double direction_with(const double* g, std::span<const double> beta, InverseOperator& inner,
                        const RankOneTerms& terms, double* p, std::span<const double> known = {});

  std::int64_t size() const { return size_; }

 private:
  double* s(int k) { return pairs_.data() + (2 * slot(k)) * size_; }
  double* y(int k) { return pairs_.data() + (2 * slot(k) + 1) * size_; }
  // k = 0 is the oldest pair; one slot more than the window, where a new pair waits to be judged.
  std::int64_t slot(int k) const { return (first_ + k) % (window_ + 1); }

  // Which terms play a part, with their stiffness in the pairs and their beta; then what the pairs have along them.
  void choose_terms(const RankOneTerms& terms, std::span<const double> known, std::span<const double> beta);
  void join_terms(const RankOneTerms& terms);
  std::int64_t size_;
  int window_, threads_;
  int first_ = 0, count_ = 0;
  Aligned<double> pairs_;  // (window + 1, 2, size)
  std::vector<double> curvature_, alpha_;
  std::vector<double> with_terms_;        // s.y' of each pair
  std::vector<std::int32_t> which_;       // terms that play a part: of them are all that follow
  std::vector<double> known_, forces_;    // stiffness in the pairs, and beta as given
  std::vector<double> along_s_, change_;  // (pairs, terms): a_j.s, stiffness_j a_j.s
  std::vector<double> beta_, along_;      // of what is worked on: coefficients of C, and C^T p
  Aligned<double> work_;
};

}  // namespace qlb
