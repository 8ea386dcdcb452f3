/// The loop of a step: its nodes, their colours and owners, from the chunks and what glues their copies.

#include <algorithm>
#include <numeric>

#include "runtime/graph/clock.hpp"
#include "runtime/graph/loop_colours.hpp"
#include "runtime/graph/tree.hpp"
#include "runtime/step/step_graph.hpp"
#include "runtime/trace/order.hpp"

namespace talus {

namespace {

/// Where nothing is told, chunks at glued walls are of the border.
graph::ChunkOrder::Side side_of(ChunkSide side, bool tells) {
  using enum graph::ChunkOrder::Side;
  switch (side) {
    case ChunkSide::wall:
      return tells ? early : border;
    case ChunkSide::border:
      return border;
    case ChunkSide::inside:
      return inside;
    case ChunkSide::late:
      break;
  }
  return late;
}

}  // namespace

void StepGraph::plan_iteration() {
  reset_to_free(state_.chunks.untouched, state_.free, state_.bodies.velocity);
  if (!planned_) {
    const double planning = graph::seconds_now();
    loop_.plan_tree();
    if (state_.decomposition.several()) sums_.times.dealing += graph::seconds_now() - planning;
  }
  loop_.begin();
  if (!planned_) plan_epochs();
  followed_ = order_ && order_->begin_step(static_cast<std::uint32_t>(steps_));
  iterating_ = graph::seconds_now();
}

/// Chunks as they conflict; and, where copies are glued, tell[e] behind the chunks of e at glued walls,
/// publish[e] behind those at its border, too, the root and, where the tree has one, collect behind tells,
/// glue[e] last; of those e whose subdomain colour is not the first take[e] before the border
/// (solver_loop.hpp).
void StepGraph::plan_epochs() {
  const Chunks& chunks = state_.chunks;
  const Gluing& gluing = loop_.gluing();
  const std::size_t count = chunks.size(), here = state_.decomposition.here.size();
  const std::size_t of_rank = gluing.tasks_of_rank(), followers = gluing.followers().size(),
                    nodes = count +
                            (gluing.needed() ? 2 * here + of_rank + followers + gluing.tellers().size() : 0);
  const auto publish = [&](std::size_t e) { return static_cast<std::uint32_t>(count + e); };
  const auto root = static_cast<std::uint32_t>(count + here + of_rank - 1);
  const auto glue = [&](std::size_t e) { return static_cast<std::uint32_t>(count + here + of_rank + e); };
  std::vector<char> subdomain_colour;
  for (std::size_t e = 0; e < here; ++e)
    subdomain_colour.push_back(static_cast<char>(gluing.subdomain_colour(e)));
  std::vector<std::uint32_t> take(here, 0), tell(here, 0);
  std::vector<char> tells(here, 0);
  auto next = static_cast<std::uint32_t>(count + 2 * here + of_rank);
  for (const std::uint32_t e : gluing.followers()) take[e] = next++;
  for (const std::uint32_t e : gluing.tellers()) {
    tell[e] = next++;
    tells[e] = 1;
  }
  const auto reading = [&](std::size_t reader, std::size_t from) {
    return gluing.reads_early(reader, from) ? take[reader] : glue(reader);
  };

  std::vector<std::uint32_t> colour(nodes), offset(1, 0), neighbour;
  std::vector<std::vector<std::uint32_t>> boundary(here), at_walls(here);
  // The tree of ranks has its part among chunks, so that the way there and the way back are both hidden. It
  // touches what walls' chunks have written and glue will read: before or behind others the bits are the
  // same.
  std::vector<graph::ChunkOrder> subdomain_colours;
  for (std::size_t c = 0; c < count; ++c)
    subdomain_colours.push_back(
        {side_of(chunks.side[c], tells[static_cast<std::size_t>(chunks.subdomain[c])] != 0),
         static_cast<std::uint32_t>(chunks.subdomain[c]), static_cast<std::uint32_t>(chunks.colour[c])});
  const graph::LoopColours colours =
      graph::loop_colours(subdomain_colours, subdomain_colour, tells, state_.decomposition.in_colours(),
                          decomposition_.overlap, executor_.threads(), ranks_.rank(), gluing.tree());
  std::copy(colours.chunk.begin(), colours.chunk.end(), colour.begin());
  for (std::size_t c = 0; c < count; ++c) {
    const auto e = static_cast<std::size_t>(chunks.subdomain[c]);
    const bool at_interface = gluing.needed() && chunks.side[c] != ChunkSide::inside;
    neighbour.insert(neighbour.end(), chunks.conflicts.begin() + chunks.conflict_begin[c],
                     chunks.conflicts.begin() + chunks.conflict_begin[c + 1]);
    if (at_interface) {
      neighbour.push_back(publish(e));
      neighbour.push_back(glue(e));
      if (subdomain_colour[e] > 0) neighbour.push_back(take[e]);
      boundary[e].push_back(static_cast<std::uint32_t>(c));
      if (tells[e] != 0 && chunks.side[c] == ChunkSide::wall) {
        neighbour.push_back(tell[e]);
        at_walls[e].push_back(static_cast<std::uint32_t>(c));
      }
    }
    offset.push_back(static_cast<std::uint32_t>(neighbour.size()));
  }
  const auto to_root = [&] {
    for (auto task = static_cast<std::uint32_t>(count + here); task <= root; ++task)
      neighbour.push_back(task);
  };
  const auto from_subdomains = [&] {
    for (std::size_t e = 0; e < here; ++e)
      if (tells[e] != 0)
        neighbour.push_back(tell[e]);
      else if (subdomain_colour[e] == 0)
        neighbour.push_back(publish(e));
  };
  if (gluing.needed()) {
    for (std::size_t e = 0; e < here; ++e) {
      colour[publish(e)] = colours.publish[e];
      neighbour.insert(neighbour.end(), boundary[e].begin(), boundary[e].end());
      if (tells[e] == 0 && subdomain_colour[e] == 0) to_root();
      neighbour.push_back(glue(e));
      if (subdomain_colour[e] > 0) neighbour.push_back(take[e]);
      for (std::uint32_t reader : gluing.readers_here(e)) neighbour.push_back(reading(reader, e));
      offset.push_back(static_cast<std::uint32_t>(neighbour.size()));
    }
    if (of_rank > 1) {
      colour[count + here] = colours.tree.up;
      from_subdomains();
      offset.push_back(static_cast<std::uint32_t>(neighbour.size()));
    }
    colour[root] = colours.tree.down;
    from_subdomains();
    for (std::size_t e = 0; e < here; ++e) neighbour.push_back(glue(e));
    offset.push_back(static_cast<std::uint32_t>(neighbour.size()));
    for (std::size_t e = 0; e < here; ++e) {
      colour[glue(e)] = colours.glue;
      neighbour.insert(neighbour.end(), boundary[e].begin(), boundary[e].end());
      neighbour.push_back(root);
      neighbour.push_back(publish(e));
      if (subdomain_colour[e] > 0) neighbour.push_back(take[e]);
      if (tells[e] != 0) neighbour.push_back(tell[e]);
      for (std::uint32_t writer : gluing.readers_here(e))
        if (!gluing.reads_early(e, writer)) neighbour.push_back(publish(writer));
      offset.push_back(static_cast<std::uint32_t>(neighbour.size()));
    }
    for (const std::uint32_t e : gluing.followers()) {
      colour[take[e]] = colours.take[e];
      neighbour.insert(neighbour.end(), boundary[e].begin(), boundary[e].end());
      neighbour.push_back(publish(e));
      neighbour.push_back(glue(e));
      for (std::uint32_t writer : gluing.readers_here(e))
        if (gluing.reads_early(e, writer)) neighbour.push_back(publish(writer));
      offset.push_back(static_cast<std::uint32_t>(neighbour.size()));
    }
    for (const std::uint32_t e : gluing.tellers()) {
      colour[tell[e]] = colours.tell[e];
      neighbour.insert(neighbour.end(), at_walls[e].begin(), at_walls[e].end());
      to_root();
      neighbour.push_back(glue(e));
      offset.push_back(static_cast<std::uint32_t>(neighbour.size()));
    }
  }

  // Bodies stand in Morton order, subdomain after subdomain, so the first body of a chunk says where it lies;
  // walls' chunks go to whoever sweeps the grains beside them, and a subdomain's gluing to who has its first
  // chunk.
  std::vector<std::uint32_t> order(count), weight(count), subdomain(count), owner_in_order(count),
      owner(nodes, 0);
  std::iota(order.begin(), order.end(), 0u);
  const auto place = [&](std::uint32_t c) {
    return chunks.bodies[static_cast<std::size_t>(chunks.body_begin[c])];
  };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return place(a) < place(b); });
  for (std::size_t k = 0; k < count; ++k) {
    weight[k] = 1 + static_cast<std::uint32_t>(state_.contacts.count[order[k]]);
    subdomain[k] = static_cast<std::uint32_t>(chunks.subdomain[order[k]]);
  }
  graph::assign_owners(weight, subdomain, executor_.threads(), owner_in_order);
  for (std::size_t k = count; k-- > 0;) {
    owner[order[k]] = owner_in_order[k];
    if (!gluing.needed() || (ranks_.ranks() > 1 && !ranks_.any_thread())) continue;
    const auto e = static_cast<std::size_t>(chunks.subdomain[order[k]]);
    owner[publish(e)] = owner[glue(e)] = owner_in_order[k];
    if (subdomain_colour[e] > 0) owner[take[e]] = owner_in_order[k];
    if (tells[e] != 0) owner[tell[e]] = owner_in_order[k];
  }
  epochs_.build({colour, offset, neighbour}, owner, executor_.threads());
  if (executor_.trace() || executor_.times() || order_) note_plan({colour, offset, neighbour}, owner);
  planned_ = true;
}

}  // namespace talus
