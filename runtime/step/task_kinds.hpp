#pragma once

#include <vector>

#include "runtime/trace/trace.hpp"

namespace talus {

/// What the tasks of a step do, as a trace names it; the first are trace::runtime_kinds().
enum class TaskKind : std::uint8_t {
  predict = 6,
  cells,
  pairs,
  chunks,
  narrow,
  plan,
  finish,
  walls,
  report,
  sum,
  partition,  ///< within cells and chunks: regions, migration, interfaces, channels
  accumulate,
  measure,
  sweep,
  restore,
  publish,
  root,
  glue,
  take,
  tell,
  whole,    ///< within a check: looks at the whole problem, or solves it; node: trace::Meetings
  sums,     ///< within a check: a rank adds up what its chunks have measured
  position  ///< a sweep that undoes overlaps
};

inline trace::Kind kind_of(TaskKind kind) {
  return static_cast<trace::Kind>(kind);
}

/// All kinds in the order of their numbers.
std::vector<trace::KindInfo> task_kinds();

}  // namespace talus
