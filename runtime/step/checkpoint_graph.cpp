/// What StepGraph and its loop remember from step to step, in a checkpoint.

#include <algorithm>

#include "kernels/bodies/index.hpp"
#include "runtime/step/checkpoint.hpp"
#include "runtime/step/step_graph.hpp"

namespace talus {

void StepGraph::save(Checkpoint& to) const {
  CheckpointHead& head = to.head;
  head.wall_margins = wall_margin_;
  head.graph_steps = steps_;
  head.partitioned = partitioned_;
  head.imbalance_then = imbalance_then_;
  head.contacts_before = contacts_before_;
  head.imbalance_before = imbalance_before_;
  head.farthest = loop_.problem().farthest();
  head.stiffness = loop_.problem().stiffness();
  head.velocity_errors = loop_.problem().velocity_errors();
  head.answers = loop_.problem().answers();
  const std::vector<float>& pushes = loop_.positions().pushes();
  if (pushes.empty() || !state_.candidates_valid) return;
  for (std::size_t c = 0; c < state_.chunks.size(); ++c) {
    std::vector<float>& part = to.parts[at(state_.chunks.subdomain[c])].pushes;
    part.insert(part.end(), pushes.begin() + state_.chunks.begin[c],
                pushes.begin() + state_.chunks.begin[c + 1]);
  }
}

void StepGraph::restore(const Checkpoint& from) {
  const CheckpointHead& head = from.head;
  wall_margin_ = head.wall_margins;
  steps_ = head.graph_steps;
  partitioned_ = head.partitioned;
  imbalance_then_ = head.imbalance_then;
  contacts_before_ = head.contacts_before;
  imbalance_before_ = head.imbalance_before;
  std::int64_t candidates[1] = {static_cast<std::int64_t>(state_.candidates.size())};
  ranks_.sum(candidates);
  all_candidates_ = candidates[0];
  const std::vector<CandidateGroup> groups = restored_groups(state_, from);
  set_up_chunks(groups);
  if (state_.candidates_valid) {
    restore_contacts(from, state_);
    loop_.plan();
    std::vector<float> pushes(state_.candidates.size());
    bool any = false;
    std::vector<std::size_t> read(from.parts.size(), 0);
    for (std::size_t c = 0; c < state_.chunks.size(); ++c) {
      const std::size_t e = at(state_.chunks.subdomain[c]);
      const std::vector<float>& part = from.parts[e].pushes;
      if (part.empty()) continue;
      any = true;
      for (std::int32_t k = state_.chunks.begin[c]; k < state_.chunks.begin[c + 1]; ++k)
        pushes[at(k)] = part.at(read[e]++);
    }
    if (any) loop_.positions().go_on_from(std::move(pushes));
  }
  loop_.problem().go_on_from(head.stiffness, head.velocity_errors, head.answers, head.farthest);
}

}  // namespace talus
