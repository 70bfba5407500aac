// Array types and checks shared by the bindings. Inputs may be converted; outputs are written in place, never
// copied.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>

namespace qlb {

namespace nb = nanobind;

template <class T>
using Array = nb::ndarray<T, nb::c_contig, nb::device::cpu>;

template <class T>
std::span<T> view(const Array<T>& array) {
  return {array.data(), array.size()};
}

template <class T>
T* sized(const Array<T>& array, std::int64_t size, const char* name) {
  if (static_cast<std::int64_t>(array.size()) != size)
    throw std::invalid_argument(std::string(name) + " has " + std::to_string(array.size()) + " entries, expected " +
                                std::to_string(size));
  return array.data();
}

using ReleaseGil = nb::call_guard<nb::gil_scoped_release>;

void bind_assembly(nb::module_& m);
void bind_barrier(nb::module_& m);
void bind_candidates(nb::module_& m);
void bind_cholmod(nb::module_& m);  // only where CHOLMOD is built in
void bind_contact(nb::module_& m);
void bind_energies(nb::module_& m);
void bind_linalg(nb::module_& m);
void bind_low_rank(nb::module_& m);
void bind_terms(nb::module_& m);
void bind_program(nb::module_& m);

}  // namespace qlb
