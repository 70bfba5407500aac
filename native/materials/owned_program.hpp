// The memory of a Program (materials/program.hpp), and the checks that make it safe to run.
#pragma once

#include <array>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "materials/program.hpp"

namespace qlb {

// One list as it comes from Python.
struct ListSource {
  std::span<const std::int32_t> operations;  // (k)
  std::span<const std::int32_t> registers;   // (k, 4): target, a, b, c
  std::span<const double> constants;
  std::span<const std::int32_t> outputs;
};

class OwnedProgram {
 public:
  // Throws std::invalid_argument for an operation that is not known, a register that is not there or is read before it
  // is set, a constant that is not finite, or too many of something.
  OwnedProgram(int parameter_count, const ListSource& energy, const ListSource& slopes, const ListSource& derivatives);
  OwnedProgram(const OwnedProgram&) = delete;
  OwnedProgram& operator=(const OwnedProgram&) = delete;

  const Program& view() const { return view_; }

 private:
  struct List {
    std::vector<Instruction> instructions;
    std::vector<double> constants;
    std::vector<std::uint8_t> outputs;
  };
  static List checked(int parameter_count, const ListSource& source, int outputs);

  std::array<List, 3> lists_;
  Program view_;
};

// Every operation in the order of `Operation`: its name, and how many registers it reads.
std::vector<std::pair<std::string, int>> program_operations();

}  // namespace qlb
