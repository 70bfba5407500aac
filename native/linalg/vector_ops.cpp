#include "linalg/vector_ops.hpp"

#include <algorithm>
#include <vector>

namespace qlb {
namespace {
constexpr std::int64_t kGroup = 8192;  // entries summed together: the grouping never depends on the threads
}

double dot(const double* a, const double* b, std::int64_t n, int threads) {
  const std::int64_t groups = (n + kGroup - 1) / kGroup;
  thread_local std::vector<double> storage;
  storage.assign(groups, 0.0);
  double* partial = storage.data();
#pragma omp parallel for schedule(static) num_threads(threads) if (groups > 4)
  for (std::int64_t g = 0; g < groups; ++g) {
    double sum = 0.0;
    const std::int64_t last = std::min(n, (g + 1) * kGroup);
#pragma omp simd reduction(+ : sum)
    for (std::int64_t k = g * kGroup; k < last; ++k) sum += a[k] * b[k];
    partial[g] = sum;
  }
  double total = 0.0;
  for (std::int64_t g = 0; g < groups; ++g) total += partial[g];
  return total;
}

void add_scaled(double scale, const double* a, double* b, std::int64_t n, int threads) {
#pragma omp parallel for simd schedule(static) num_threads(threads) if (n > 4 * kGroup)
  for (std::int64_t k = 0; k < n; ++k) b[k] += scale * a[k];
}

}  // namespace qlb
