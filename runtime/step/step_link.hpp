#pragma once

/// How the parts of the problem that all contacts of a step make, one for each subdomain, work together.

#include <cstddef>
#include <functional>
#include <vector>

#include "kernels/global/body_parts.hpp"
#include "runtime/graph/communicator.hpp"
#include "runtime/graph/crew.hpp"
#include "runtime/step/gluing.hpp"
#include "runtime/step/state.hpp"
#include "runtime/trace/recorder.hpp"
#include "runtime/trace/trace.hpp"

namespace talus {

/// The copies agree by the messages of the gluing; rows travel to all ranks; threads share the subdomains.
class StepLink final : public PartLink {
 public:
  /// Keeps references. Counts what ranks do together in `rounds`, and of runs that are recorded what threads
  /// share in `shared`.
  StepLink(const StepState& state, Gluing& gluing, const graph::Communicator& ranks, graph::Crew& crew,
           trace::Meetings& rounds, trace::SharedWork& shared)
      : state_(state), gluing_(gluing), ranks_(ranks), crew_(crew), rounds_(rounds), shared_(shared) {}

  bool several() const override { return state_.decomposition.several(); }
  void each(std::size_t parts, const std::function<void(std::size_t)>& work) const override;
  void sum_copies(PartField& field) const override;
  std::vector<double> gather(std::vector<std::vector<double>> rows) const override;

 private:
  const StepState& state_;
  Gluing& gluing_;
  const graph::Communicator& ranks_;
  graph::Crew& crew_;
  trace::Meetings& rounds_;
  trace::SharedWork& shared_;
};

}  // namespace talus
