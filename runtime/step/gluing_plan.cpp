/// Who sends what to whom in an exchange, and when each subdomain reads which copies of a body.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <stdexcept>

#include "runtime/step/detail/gluing_parts.hpp"

namespace talus {

using detail::behind_all;
using detail::tag_of;

Gluing::Gluing(StepState& state, const DecompositionSettings& settings, const graph::Communicator& ranks)
    : state_(state), settings_(settings), ranks_(ranks) {}

Gluing::~Gluing() = default;

void Gluing::plan(bool rotation) {
  const Decomposition& all = state_.decomposition;
  width_ = rotation ? 6 : 3;
  walls_.clear();
  for (std::size_t w = 0; w < state_.walls.size(); ++w)
    if (state_.walls[w].inv_mass() > 0) walls_.push_back(static_cast<std::int32_t>(w));
  needed_ = all.several() || vectors() > 0;
  if (const std::int64_t subdomains = all.partition.subdomains;
      ranks_.ranks() > 1 && subdomains * subdomains + detail::root_tag > ranks_.largest_tag())
    throw std::invalid_argument(fmt::format(
        "{} subdomains on several ranks need message tags up to {}, and this MPI has {}: take fewer "
        "subdomains",
        subdomains, subdomains * subdomains + detail::root_tag, ranks_.largest_tag()));
  // Channels of the plan before must be closed on all ranks before new ones of the same tag are used.
  subdomains_.clear();
  root_.reset();
  subdomains_.resize(all.here.size());
  jumps_.assign(all.here.size(), {});
  messages_ = {};
  if (!needed_) return;
  for (const SubdomainPlace e : subdomains_.indices()) {
    plan_sides(e);
    plan_copies(e);
    subdomains_[e].tells =
        all.several() && vectors() > 0 && !state_.cell.loaded() && all.interfaces[e].hubs.empty();
  }
  for (const SubdomainPlace e : subdomains_.indices())
    for (Side& side : subdomains_[e].sides) {
      if (side.local.none()) continue;
      for (const Side& back : subdomains_[side.local].sides)
        if (back.local == e) side.source = detail::bytes_of(back.link.out);
    }
}

int Gluing::subdomain_colour(SubdomainPlace e) const {
  return state_.decomposition.subdomain_colour_of(state_.decomposition.here[e]);
}

void Gluing::plan_sides(SubdomainPlace e) {
  const Decomposition& all = state_.decomposition;
  Subdomain& mine = subdomains_[e];
  mine.subdomain_colour = subdomain_colour(e);
  mine.wall_copies.resize(vectors());
  if (!all.several()) return;
  const SubdomainInterface& interface = all.interfaces[e];
  const auto slot_of = [&](std::int32_t body) { return static_cast<Slot>(all.slots_of(e).begin + at(body)); };
  for (std::int32_t s : interface.shared) mine.shared.push_back(slot_of(s));
  if (settings_.coupling == Coupling::schwarz) mine.base.resize(mine.shared.size() * width_);
  mine.sides.resize(interface.neighbours.size());
  for (std::size_t n = 0; n < mine.sides.size(); ++n) {
    const Neighbour& neighbour = interface.neighbours[n];
    Side& side = mine.sides[n];
    for (std::int32_t k = neighbour.begin; k < neighbour.end; ++k)
      side.slots.push_back(slot_of(interface.exchange[at(k)]));
    side.subdomain_colour = all.subdomain_colour_of(neighbour.subdomain);
    const std::int32_t rank = all.rank_of[neighbour.subdomain];
    const std::size_t length = side.slots.size() * width_;
    side.link.out.resize(length);
    if (rank == ranks_.rank()) {
      side.local = all.place_of(neighbour.subdomain);
      continue;
    }
    side.link.in.resize(length);
    side.source = detail::bytes_of(side.link.in);
    const std::int32_t count = all.partition.subdomains;
    side.link.sender =
        ranks_.open_send(rank, tag_of(interface.subdomain, neighbour.subdomain, count), side.link.out);
    side.link.receiver =
        ranks_.open_receive(rank, tag_of(neighbour.subdomain, interface.subdomain, count), side.link.in);
    const auto mine_of_all = static_cast<std::uint32_t>(interface.subdomain.value());
    const auto other = static_cast<std::uint32_t>(neighbour.subdomain.value());
    side.link.out_name = trace::message_name(mine_of_all, other);
    side.link.in_name = trace::message_name(other, mine_of_all);
    side.link.receiver->start();
  }
}

/// Lists which copies of a shared body a subdomain reads, and when.
void Gluing::plan_copies(SubdomainPlace e) {
  const Decomposition& all = state_.decomposition;
  Subdomain& mine = subdomains_[e];
  for (std::size_t s = 0; s < mine.shared.size(); ++s) {
    const auto copies = copies_of(e, s);
    if (copies.empty()) continue;  // a hub
    const Slot slot = mine.shared[s];
    const auto latest_before = [&](int subdomain_colour) {
      std::vector<CopySource> latest;
      const int before = latest_colour(e, s, subdomain_colour);
      std::ranges::copy_if(copies, std::back_inserter(latest),
                           [&](const CopySource& copy) { return subdomain_colour_of(e, copy) == before; });
      return latest;
    };
    if (!all.taken.empty() && all.taken[at(slot)] != 0) {
      const std::vector<CopySource> earlier = latest_before(mine.subdomain_colour);
      mine.taken.push_back(slot);
      if (earlier.size() > 1)
        mine.taken_corners.push_back(static_cast<std::int32_t>(s));
      else
        mine.sides[at(earlier[0].neighbour)].taken.push_back({slot, earlier[0].place});
    }
    const std::vector<CopySource> last = latest_before(behind_all);
    const bool own = subdomain_colour_of(e, last[0]) == mine.subdomain_colour;
    if (last.size() > 2 || (last.size() == 2 && !own)) {
      mine.corners.push_back(static_cast<std::int32_t>(s));
    } else if (last.size() == 2) {
      const CopySource& other = last[last[0].neighbour < 0 ? 1 : 0];
      mine.sides[at(other.neighbour)].pairs.push_back({slot, other.place});
    } else if (!own) {
      mine.sides[at(last[0].neighbour)].given.push_back({slot, last[0].place});
    }
  }
}

void Gluing::count_messages() {
  std::array<std::int64_t, 4> count{};
  const auto add = [&](std::size_t doubles, bool between) {
    count[0] += 1;
    count[1] += static_cast<std::int64_t>(8 * doubles);
    count[2] += between ? 1 : 0;
    count[3] += between ? static_cast<std::int64_t>(8 * doubles) : 0;
  };
  for (const Subdomain& subdomain : subdomains_) {
    for (const Side& side : subdomain.sides) add(side.slots.size() * width_, side.local.none());
    if (subdomain.partial.empty() || !state_.decomposition.several()) continue;
    add(subdomain.partial.size(), false);                            // to the root
    add(3 * vectors() + subdomain.hub_item.size() * width_, false);  // and back
  }
  if (root_ && root_->up) {
    count[2] += 2;
    count[3] += static_cast<std::int64_t>(8 * (root_->up->out.size() + root_->up->in.size()));
  }
  ranks_.sum(count);
  messages_ = {count[0], count[1], count[2], count[3]};
}

std::vector<trace::Message> Gluing::message_plan() const {
  const Decomposition& all = state_.decomposition;
  std::vector<trace::Message> plan;
  const auto add = [&](std::int32_t from, std::int32_t to, std::size_t doubles) {
    plan.push_back({static_cast<std::uint16_t>(from), static_cast<std::uint16_t>(to),
                    static_cast<std::uint32_t>(8 * doubles)});
  };
  if (!all.several()) return plan;
  for (const SubdomainPlace e : subdomains_.indices()) {
    const Subdomain& subdomain = subdomains_[e];
    const std::int32_t own = all.here[e].value();
    for (std::size_t n = 0; n < subdomain.sides.size(); ++n)
      add(own, all.interfaces[e].neighbours[n].subdomain.value(), subdomain.sides[n].slots.size() * width_);
    if (subdomain.partial.empty()) continue;
    add(own, trace::root_group, subdomain.partial.size());
    add(trace::root_group, own, 3 * vectors() + subdomain.hub_item.size() * width_);
  }
  return plan;
}

std::vector<SubdomainPlace> Gluing::readers_here(SubdomainPlace e) const {
  std::vector<SubdomainPlace> readers;
  for (const Side& side : subdomains_[e].sides)
    if (!side.local.none()) readers.push_back(side.local);
  return readers;
}

bool Gluing::tells(SubdomainPlace e) const {
  return subdomains_[e].tells;
}

std::span<const Slot> Gluing::taken(SubdomainPlace e) const {
  return subdomains_[e].taken;
}

}  // namespace talus
