#include "runtime/step/gluing.hpp"

#include <algorithm>
#include <utility>

#include "kernels/sweeps/fetch_lines.hpp"
#include "runtime/step/detail/gluing_parts.hpp"
#include "runtime/step/detail/packed_velocity.hpp"

namespace talus {

using detail::any_colour;
using detail::assign;
using detail::await;
using detail::behind_all;
using detail::mean;
using detail::number_at;
using detail::Numbers;
using detail::numbers_of;
using detail::Pair;
using detail::settle_pairs;
using detail::start;
using detail::taken_over;
using detail::write_velocities;

/// Number of vectors of three numbers that go through the root in any case: one for each wall of finite mass,
/// two for a cell that follows a stress.
std::size_t Gluing::vectors() const {
  return walls_.size() + (state_.cell.loaded() ? cell_freedoms / 3 : 0);
}

/// Number of copies of vector `g`, on all ranks.
std::int64_t Gluing::copies_everywhere(std::size_t g) const {
  return g < walls_.size() ? state_.wall_states[at(walls_[g])].copies_everywhere
                           : state_.cell.copies_everywhere;
}

/// Vector `g` in the copy that a chunk holds.
double* Gluing::copy_of(std::size_t g, ChunkId chunk) {
  if (g < walls_.size()) return state_.copies[chunk.at()].velocity;
  return &state_.cell.copies[chunk.at()].velocity[3 * (g - walls_.size())];
}

void Gluing::begin() {
  for (Subdomain& subdomain : subdomains_) {
    subdomain.waited = 0;
    for (auto& copies : subdomain.wall_copies) copies.clear();
  }
  if (root_) root_->waited = 0;
  std::vector<std::int64_t> copies(state_.walls.size() + 1, 0);
  copies.back() = static_cast<std::int64_t>(state_.cell.held.size());
  for (std::size_t w = 0; w < state_.walls.size(); ++w)
    copies[w] = static_cast<std::int64_t>(state_.wall_states[w].copies.size());
  if (vectors() > 0) ranks_.sum(copies);
  state_.cell.copies_everywhere = copies.back();
  for (std::size_t w = 0; w < state_.walls.size(); ++w) state_.wall_states[w].copies_everywhere = copies[w];
  for (std::size_t g = 0; g < walls_.size(); ++g)
    for (const ChunkId c : state_.wall_states[at(walls_[g])].copies)
      subdomains_[SubdomainPlace(state_.chunks.subdomain[c.at()])].wall_copies[g].push_back(c);
  for (std::size_t g = walls_.size(); g < vectors(); ++g)
    for (const ChunkId c : state_.cell.held)
      subdomains_[SubdomainPlace(state_.chunks.subdomain[c.at()])].wall_copies[g].push_back(c);
}

/// Copies of the body interfaces[e].shared[s]; none of a hub.
std::span<const CopySource> Gluing::copies_of(SubdomainPlace e, std::size_t s) const {
  const SubdomainInterface& interface = state_.decomposition.interfaces[e];
  return std::span(interface.copies)
      .subspan(at(interface.copies_begin[s]), at(interface.copies_begin[s + 1] - interface.copies_begin[s]));
}

int Gluing::subdomain_colour_of(SubdomainPlace e, const CopySource& copy) const {
  return copy.neighbour < 0 ? subdomains_[e].subdomain_colour
                            : subdomains_[e].sides[at(copy.neighbour)].subdomain_colour;
}

/// The latest subdomain colour below `before` that a copy of interfaces[e].shared[s] has; -1: none.
int Gluing::latest_colour(SubdomainPlace e, std::size_t s, int before) const {
  int latest = -1;
  for (const CopySource& copy : copies_of(e, s))
    if (const int subdomain_colour = subdomain_colour_of(e, copy); subdomain_colour < before)
      latest = std::max(latest, subdomain_colour);
  return latest;
}

/// Calls work<width>(velocities) with the records that sweeps work on.
template <class Work>
void Gluing::with_bodies(bool single, const Work& work) {
  const auto with = [&](auto velocity) {
    if (width_ == 6)
      work.template operator()<6>(velocity);
    else
      work.template operator()<3>(velocity);
  };
  if (single)
    with(std::span(state_.single.velocity));
  else
    with(std::span(state_.bodies.velocity));
}

template <std::size_t Width, class Record>
void Gluing::publish_bodies(SubdomainPlace e, std::span<const Record> velocity) {
  Subdomain& mine = subdomains_[e];
  for (Side& side : mine.sides) {
    if (side.link.sender) await(*side.link.sender, mine.waited, ranks_.trace(), side.link.out_name);
    write_velocities<Width>(velocity, std::span<const Slot>(side.slots), detail::bytes_of(side.link.out));
  }
  if (mine.hub_item.empty()) return;
  double* out = &mine.partial[3 * vectors()];
  for (const std::int32_t hub : state_.decomposition.interfaces[e].hubs) {
    const Numbers<Width, Record> numbers = numbers_of<Width>(velocity[at(mine.shared[at(hub)])]);
    out = std::copy(numbers.begin(), numbers.end(), out);
  }
}

void Gluing::publish(SubdomainPlace e, Mode mode, bool single) {
  if (mode == Mode::local) return;
  Subdomain& mine = subdomains_[e];
  with_bodies(single, [&]<std::size_t Width, class Record>(std::span<Record> velocity) {
    publish_bodies<Width, Record>(e, velocity);
  });
  for (Side& side : mine.sides)
    if (side.link.sender) start(*side.link.sender, ranks_.trace(), side.link.out_name);
  if (!mine.tells || mode == Mode::sum) tell(e, mode);
}

void Gluing::tell(SubdomainPlace e, Mode mode) {
  if (mode == Mode::local) return;
  Subdomain& mine = subdomains_[e];
  for (std::size_t g = 0; g < vectors() && mode != Mode::sum; ++g) {
    double* sum = &mine.partial[3 * g];
    std::fill_n(sum, 3, 0.0);
    for (const ChunkId c : mine.wall_copies[g])
      for (std::size_t k = 0; k < 3; ++k) sum[k] += copy_of(g, c)[k];
  }
  if (!root_->up || !root_->links.empty()) return;
  // The last of a leaf's subdomains sends for all: acquire on the count shows it what the others wrote.
  if (root_->published.fetch_add(1, std::memory_order_acq_rel) + 1 < subdomains_.size()) return;
  root_->published.store(0, std::memory_order_relaxed);
  send_up();
}

void Gluing::glue(SubdomainPlace e, Mode mode, bool single) {
  Subdomain& mine = subdomains_[e];
  for (std::size_t g = 0; g < vectors() && mode != Mode::sum; ++g) {
    const auto& copies = mine.wall_copies[g];
    if (copies.empty()) continue;
    if (mode == Mode::local) {
      glue_vectors(copies.size(), [&](std::size_t k) { return copy_of(g, copies[k]); });
      continue;
    }
    const double part = 1 / static_cast<double>(copies_everywhere(g));
    for (const ChunkId c : copies)
      for (std::size_t k = 0; k < 3; ++k) copy_of(g, c)[k] = part * root_->sums[3 * g + k];
  }
  if (mode == Mode::local || !state_.decomposition.several()) return;
  const auto of_glue = [&](const Side& side) {
    return mode == Mode::sum || side.subdomain_colour >= mine.subdomain_colour;
  };
  await_messages(e, of_glue);
  with_bodies(single, [&]<std::size_t Width, class Record>(std::span<Record> velocity) {
    glue_bodies<Width, Record>(e, mode, velocity);
  });
  ask_for_messages(e, of_glue);
}

void Gluing::take(SubdomainPlace e, bool single) {
  const auto of_take = [mine = subdomain_colour(e)](const Side& side) {
    return side.subdomain_colour < mine;
  };
  await_messages(e, of_take);
  with_bodies(single, [&]<std::size_t Width, class Record>(std::span<Record> velocity) {
    take_bodies<Width, Record>(e, velocity);
  });
  ask_for_messages(e, of_take);
}

template <class Which>
void Gluing::await_messages(SubdomainPlace e, const Which& which) {
  Subdomain& mine = subdomains_[e];
  for (Side& side : mine.sides)
    if (side.link.receiver && which(side))
      await(*side.link.receiver, mine.waited, ranks_.trace(), side.link.in_name);
}

template <class Which>
void Gluing::ask_for_messages(SubdomainPlace e, const Which& which) {
  for (Side& side : subdomains_[e].sides)
    if (side.link.receiver && which(side)) side.link.receiver->start();
}

/// The copies of interface.shared[s] that are of the latest subdomain colour below `before`, or all with
/// `any_colour`: their sum in order of subdomain, how many they are, and whether the own one is among them.
template <std::size_t Width, class Record>
auto Gluing::add_copies(SubdomainPlace e, std::size_t s, int before, std::span<const Record> velocity) const {
  using Own = Numbers<Width, Record>;
  using Number = typename Own::value_type;
  const Subdomain& mine = subdomains_[e];
  const int latest = latest_colour(e, s, before);
  struct {
    Own sum{};
    Number count = 0;
    bool own = false;
  } added;
  for (const CopySource& copy : copies_of(e, s)) {
    if (before != any_colour && subdomain_colour_of(e, copy) != latest) continue;
    added.count += 1;
    if (copy.neighbour < 0) {
      const Own own = numbers_of<Width>(velocity[at(mine.shared[s])]);
      for (std::size_t k = 0; k < Width; ++k) added.sum[k] += own[k];
      added.own = true;
      continue;
    }
    const std::byte* const from = mine.sides[at(copy.neighbour)].source + copy.place.at() * sizeof(Own);
    for (std::size_t k = 0; k < Width; ++k) added.sum[k] += number_at<Number>(from, k);
  }
  return added;
}

void Gluing::fetch(SubdomainPlace e) const {
  if (!needed_) return;
  const auto fetch = [](const auto&... lists) { (fetch_lines(std::span(std::as_const(lists))), ...); };
  const Subdomain& mine = subdomains_[e];
  for (const Side& side : mine.sides) {
    fetch(side.slots, side.pairs, side.given, side.taken, side.link.out);
    // The neighbour's message is as long as the one to it.
    if (side.source) fetch_lines(std::span(side.source, side.link.out.size() * sizeof(double)));
  }
  fetch(mine.shared, mine.taken, mine.corners, mine.taken_corners, mine.base, mine.partial);
}

template <std::size_t Width, class Record>
void Gluing::take_bodies(SubdomainPlace e, std::span<Record> velocity) {
  const Subdomain& mine = subdomains_[e];
  for (const Side& side : mine.sides)
    settle_pairs<Width>(velocity, std::span<const Pair>(side.taken), side.source, taken_over);
  for (const std::int32_t s : mine.taken_corners) {
    auto earlier = add_copies<Width, Record>(e, at(s), mine.subdomain_colour, velocity);
    for (auto& number : earlier.sum) number /= earlier.count;
    assign<Width>(earlier.sum, velocity[at(mine.shared[at(s)])]);
  }
}

template <std::size_t Width, class Record>
void Gluing::glue_bodies(SubdomainPlace e, Mode mode, std::span<Record> velocity) {
  using Own = Numbers<Width, Record>;
  using Number = typename Own::value_type;
  Subdomain& mine = subdomains_[e];
  const SubdomainInterface& interface = state_.decomposition.interfaces[e];
  const bool schwarz = settings_.coupling == Coupling::schwarz;
  JumpSums jump;
  // Gives a copy the velocity that all copies of its body continue with.
  const auto settle = [&](std::size_t s, const Own& sum, Number m, bool own_counts) {
    const std::size_t slot = at(mine.shared[s]);
    Record& v = velocity[slot];
    Own next;
    double* base = schwarz ? &mine.base[s * Width] : nullptr;
    if (schwarz && mode == Mode::fresh)
      for (std::size_t k = 0; k < Width; ++k)
        base[k] = k < 3 ? state_.free.u[slot][k] : state_.free.w[slot][k - 3];
    for (std::size_t k = 0; k < Width; ++k)
      next[k] = mode == Mode::sum ? sum[k]
                : schwarz         ? static_cast<Number>(base[k] + (sum[k] - m * base[k]))
                                  : sum[k] / m;
    if (mode == Mode::measured && own_counts) {
      const Own now = numbers_of<Width>(v);
      const auto& whole = state_.decomposition.whole[slot];
      for (std::size_t k = 0; k < Width; ++k) {
        const double mobility = m * whole[k < 3 ? 0 : 1], change = double{now[k]} - double{next[k]};
        if (mobility == 0) continue;
        jump.jump2 += change * change / mobility;
        jump.velocity2 += double{next[k]} * double{next[k]} / mobility;
      }
    }
    assign<Width>(next, v);
    if (schwarz && mode != Mode::sum) std::copy(next.begin(), next.end(), base);
  };
  const auto settle_copies = [&](std::size_t s) {
    const auto copies =
        add_copies<Width, Record>(e, s, mode == Mode::sum ? any_colour : behind_all, velocity);
    settle(s, copies.sum, copies.count, copies.own);
  };
  if (!schwarz && mode != Mode::measured && mode != Mode::sum) {
    for (const Side& side : mine.sides) {
      settle_pairs<Width>(velocity, std::span<const Pair>(side.pairs), side.source, mean);
      settle_pairs<Width>(velocity, std::span<const Pair>(side.given), side.source, taken_over);
    }
    for (const std::int32_t s : mine.corners) settle_copies(at(s));
  } else {
    for (std::size_t s = 0; s < mine.shared.size(); ++s)
      if (interface.copies_begin[s] < interface.copies_begin[s + 1]) settle_copies(s);
  }
  for (std::size_t h = 0; h < interface.hubs.size(); ++h) {
    const double* const from = &root_->sums[3 * vectors() + mine.hub_item[h] * Width];
    Own sum;
    for (std::size_t k = 0; k < Width; ++k) sum[k] = static_cast<Number>(from[k]);
    const std::size_t hub = at(interface.hubs[h]);
    settle(hub, sum, state_.decomposition.multiplicity[at(mine.shared[hub])], true);
  }
  if (mode == Mode::measured) jumps_[e] = jump;
}

/// Uses the velocities of the shared copies as buffers of the exchange.
void Gluing::sum_copies(std::span<std::vector<Twist>> field) {
  const Decomposition& all = state_.decomposition;
  const auto each_shared = [&](const auto& work) {
    std::size_t k = 0;
    for (const SubdomainPlace e : subdomains_.indices())
      for (const Slot slot : subdomains_[e].shared)
        work(state_.bodies.velocity[at(slot)], field[e.at()][at(slot) - all.slots_of(e).begin], k++);
  };
  // A cell is the last unknown; its two vectors are u and w of it.
  const std::size_t unknowns = walls_.size() + (vectors() > walls_.size() ? 1 : 0);
  const auto wall = [&](SubdomainPlace e, std::size_t g) -> Vec3& {
    std::vector<Twist>& of = field[e.at()];
    return g < walls_.size() ? of[of.size() - unknowns + g].u
                             : (g == walls_.size() ? of.back().u : of.back().w);
  };
  kept_.clear();
  each_shared([&](Velocity& v, const Twist& twist, std::size_t) {
    kept_.push_back(v);
    std::copy_n(twist.u.data(), 3, v.u);
    std::copy_n(twist.w.data(), 3, v.w);
  });
  for (const SubdomainPlace e : subdomains_.indices()) {
    for (std::size_t g = 0; g < vectors(); ++g)
      std::copy_n(wall(e, g).data(), 3, &subdomains_[e].partial[3 * g]);
    publish(e, Mode::sum);
  }
  if (collects()) collect(Mode::sum);
  root(Mode::sum);
  for (const SubdomainPlace e : subdomains_.indices()) {
    glue(e, Mode::sum);
    for (std::size_t g = 0; g < vectors(); ++g) wall(e, g) = Eigen::Map<const Vec3>(&root_->sums[3 * g]);
  }
  each_shared([&](Velocity& v, Twist& twist, std::size_t k) {
    std::copy_n(v.u, 3, twist.u.data());
    if (width_ == 6) std::copy_n(v.w, 3, twist.w.data());
    v = kept_[k];
  });
}

double Gluing::exposed() const {
  double sum = root_ ? root_->waited : 0;
  for (const Subdomain& subdomain : subdomains_) sum += subdomain.waited;
  return sum;
}

}  // namespace talus
