#pragma once

/// Scenes of `talus study certificate`, run and audited step by step.

#include <functional>

#include "apps/shared/sample_builder.hpp"
#include "apps/study_certificate/audited_run.hpp"
#include "apps/study_certificate/scene_maker.hpp"
#include "kernels/samples/sample.hpp"

namespace talus::audit {

inline AuditedRun audited(const MadeScene& made, std::int64_t steps,
                          const std::function<void(io::Scene&)>& change = {}) {
  io::Scene scene = made.scene;
  if (change) change(scene);
  io::place_walls(scene, made.grains);
  Bodies bodies;
  append(made.grains, bodies);
  return audit_run(scene, bodies, {steps, {}});
}

}  // namespace talus::audit
