// NumPy's view of vectors: of those that an object keeps, with nb::rv_policy::reference_internal, or of its own.
#pragma once

#include <array>
#include <utility>
#include <vector>

#include "bindings/bindings.hpp"

namespace qlb {

template <class T>
auto entries(const std::vector<T>& values) {
  return nb::ndarray<nb::numpy, const T, nb::ndim<1>>(values.data(), {values.size()});
}

template <class T, std::size_t width>
auto rows(const std::vector<std::array<T, width>>& values) {
  return nb::ndarray<nb::numpy, const T, nb::shape<-1, width>>(values.empty() ? nullptr : values[0].data(),
                                                               {values.size(), width});
}

// A NumPy array that owns what was in the vector.
template <class T>
auto numpy(std::vector<T>&& values) {
  auto* kept = new std::vector<T>(std::move(values));
  const nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
  return nb::ndarray<nb::numpy, T, nb::ndim<1>>(kept->data(), {kept->size()}, owner);
}

}  // namespace qlb
