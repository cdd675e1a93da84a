#pragma once
// numpy arrays as columns that C++ writes into, and failures as Python's exceptions.

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>

#include "sdk/core/lattice/assert.hpp"

namespace tandem::python {

namespace py = pybind11;

/// Raises tandem.Error.
[[noreturn]] inline void raise_error(std::int32_t code, const std::string& message) {
  const py::object type = py::module_::import("tandem.errors").attr("Error");
  PyErr_SetObject(type.ptr(), type(code, message).ptr());
  throw py::error_already_set();
}

/// The place of an array's elements. It does not keep the array alive.
template <class T>
struct ArrayColumn {
  T* first = nullptr;  ///< null: not wanted
  std::uint32_t stride = 0;
  std::uint32_t bodies = std::numeric_limits<std::uint32_t>::max();
};

/// The array has the shape (n,), or (n, components) with adjacent components; its elements are T, or bool if
/// T is a byte. `object` None: not wanted. Raises TypeError and ValueError, naming the array.
template <class T>
ArrayColumn<T> column_of(const py::handle& object, const char* name, py::ssize_t components) {
  TANDEM_ASSERT(components == 1 || components == 3 || components == 4);
  if (object.is_none()) return {};
  const auto refuse = [name](const char* what) { return py::value_error(std::string(name) + ": " + what); };
  if (!py::isinstance<py::array>(object)) throw py::type_error(std::string(name) + ": not a numpy array");
  const auto array = py::reinterpret_borrow<py::array>(object);
  const bool fits =
      py::isinstance<py::array_t<T>>(array) || (sizeof(T) == 1 && py::isinstance<py::array_t<bool>>(array));
  if (!fits)
    throw py::type_error(std::string(name) + ": must be of type " + std::string(py::str(py::dtype::of<T>())));
  if (!array.writeable()) throw refuse("is read-only");
  const py::ssize_t dimensions = components == 1 ? 1 : 2;
  if (array.ndim() != dimensions || (dimensions == 2 && array.shape(1) != components))
    throw refuse(components == 1 ? "must have one dimension"
                                 : "must have three or four columns, as its kind has");
  constexpr auto kSize = static_cast<py::ssize_t>(sizeof(T));
  const auto first = static_cast<T*>(const_cast<void*>(array.data()));
  if (array.shape(0) == 0) return {first, 0, 0};
  if (dimensions == 2 && array.strides(1) != kSize) throw refuse("a body's numbers must lie side by side");
  if (array.shape(0) >= std::numeric_limits<std::uint32_t>::max()) throw refuse("is too long");
  const auto bodies = static_cast<std::uint32_t>(array.shape(0));
  // The stride of an array with a single body means nothing.
  const py::ssize_t stride = bodies > 1 ? array.strides(0) : components * kSize;
  if (stride < components * kSize || stride % kSize != 0 || stride > std::numeric_limits<std::int32_t>::max())
    throw refuse("its bodies must follow one another, without overlap");
  if (reinterpret_cast<std::uintptr_t>(array.data()) % sizeof(T) != 0) throw refuse("is not aligned");
  return {first, static_cast<std::uint32_t>(stride), bodies};
}

}  // namespace tandem::python
