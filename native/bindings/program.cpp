#include <nanobind/stl/pair.h>

#include "bindings/bindings.hpp"
#include "materials/owned_program.hpp"

namespace qlb {
namespace {

using ListTuple = nb::typed<nb::tuple, nb::any, nb::ellipsis>;

// The arrays of one list.
struct ListArrays {
  Array<const std::int32_t> operations, registers;
  Array<const double> constants;
  Array<const std::int32_t> outputs;

  explicit ListArrays(const ListTuple& list) {
    if (list.size() != 4) throw std::invalid_argument("program: a list is (operations, registers, constants, outputs)");
    operations = nb::cast<Array<const std::int32_t>>(list[0]);
    registers = nb::cast<Array<const std::int32_t>>(list[1]);
    constants = nb::cast<Array<const double>>(list[2]);
    outputs = nb::cast<Array<const std::int32_t>>(list[3]);
  }

  ListSource source() const { return {view(operations), view(registers), view(constants), view(outputs)}; }
};

}  // namespace

void bind_program(nb::module_& m) {
  nb::class_<OwnedProgram>(
      m, "Program",
      "A density of the invariants as lists of operations: for psi; for psi, d1, d2, dJ; for all derivatives. A list "
      "is\n"
      "(operations (k), registers (k, 4): target and operands, constants, outputs). Raises ValueError for a wrong one.")
      .def(
          "__init__",
          [](OwnedProgram* self, int parameter_count, const ListTuple& energy, const ListTuple& slopes,
             const ListTuple& derivatives) {
            const ListArrays a(energy), b(slopes), c(derivatives);
            new (self) OwnedProgram(parameter_count, a.source(), b.source(), c.source());
          },
          nb::arg("parameter_count"), nb::arg("energy"), nb::arg("slopes"), nb::arg("derivatives"));
  m.def("program_operations", &program_operations, "Name and number of operands of each operation, in their order.");
  m.attr("MAX_REGISTERS") = kMaxRegisters;
  m.attr("MAX_OPERATIONS") = kMaxOperations;
}

}  // namespace qlb
