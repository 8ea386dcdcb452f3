#pragma once

/// Turns error codes of MPI into exceptions. For the sources that call MPI.

// The C interface only: the C++ bindings of old are not linked.
#define OMPI_SKIP_MPICXX
#define MPICH_SKIP_MPICXX
#include <mpi.h>

#include <cstddef>
#include <stdexcept>
#include <string>

#include "runtime/graph/detail/mpi_call.hpp"

namespace talus::graph::detail {

/// Throws std::runtime_error with MPI's own words unless `code` is MPI_SUCCESS.
inline void check(int code, const char* call) {
  if (code == MPI_SUCCESS) return;
  char text[MPI_MAX_ERROR_STRING];
  int length = 0;
  MPI_Error_string(code, text, &length);
  throw std::runtime_error(std::string(call) +
                           " failed: " + std::string(text, static_cast<std::size_t>(length)));
}

}  // namespace talus::graph::detail
