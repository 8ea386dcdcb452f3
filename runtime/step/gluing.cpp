#include "runtime/step/gluing.hpp"

#include <algorithm>
#include <array>

#include "runtime/step/detail/gluing_parts.hpp"

namespace talus {

using detail::at;
using detail::await;
using detail::start;
using detail::tag_of;

namespace {

template <std::size_t Width, class Record>
void read_velocity(const Record& v, double* out) {
  for (std::size_t k = 0; k < 3; ++k) out[k] = v.u[k];
  if constexpr (Width == 6)
    for (std::size_t k = 0; k < 3; ++k) out[k + 3] = v.w[k];
}

template <class Record>
void read_velocity(std::size_t width, const Record& v, double* out) {
  if (width == 6)
    read_velocity<6>(v, out);
  else
    read_velocity<3>(v, out);
}

/// Rounds to the numbers of the record.
template <class Record>
void assign(std::size_t width, const double* from, Record& v) {
  using Number = std::remove_cvref_t<decltype(v.u[0])>;
  for (std::size_t k = 0; k < 3; ++k) v.u[k] = static_cast<Number>(from[k]);
  for (std::size_t k = 3; k < width; ++k) v.w[k - 3] = static_cast<Number>(from[k]);
}

template <std::size_t Width, class Record>
void write_velocities(std::span<const Record> velocity, std::span<const std::size_t> slots, double* out) {
  for (const std::size_t slot : slots) {
    read_velocity<Width>(velocity[slot], out);
    out += Width;
  }
}

/// NSCDD between two measurements, what most exchanges are: each shared body takes the mean of its copies.
template <std::size_t Width, class Record>
void take_means(std::span<Record> velocity, std::span<const std::size_t> shared,
                std::span<const std::int32_t> copies_begin, const double* const* sources) {
  for (std::size_t s = 0; s < shared.size(); ++s) {
    const auto begin = at(copies_begin[s]), end = at(copies_begin[s + 1]);
    if (begin == end) continue;  // a hub
    Record& v = velocity[shared[s]];
    double own[Width], sum[Width] = {};
    read_velocity<Width>(v, own);
    for (std::size_t c = begin; c < end; ++c) {
      const double* const from = sources[c] ? sources[c] : own;
      for (std::size_t k = 0; k < Width; ++k) sum[k] += from[k];
    }
    const auto m = static_cast<double>(end - begin);
    for (double& number : sum) number /= m;
    assign(Width, sum, v);
  }
}

}  // namespace

Gluing::Gluing(StepState& state, const DecompositionSettings& settings, const graph::Communicator& ranks)
    : state_(state), settings_(settings), ranks_(ranks) {}

Gluing::~Gluing() = default;

void Gluing::plan(bool rotation) {
  const Decomposition& all = state_.decomposition;
  width_ = rotation ? 6 : 3;
  walls_.clear();
  for (std::size_t w = 0; w < state_.walls.size(); ++w)
    if (state_.walls[w].inv_mass() > 0) walls_.push_back(static_cast<std::int32_t>(w));
  needed_ = all.several() || !walls_.empty();
  // Channels of the plan before must be closed on all ranks before new ones of the same tag are used.
  subdomains_.clear();
  centre_.reset();
  subdomains_.resize(all.here.size());
  jumps_.assign(all.here.size(), {});
  messages_ = {};
  if (!needed_) return;
  for (std::size_t e = 0; e < subdomains_.size(); ++e) plan_sides(e);
  for (Subdomain& subdomain : subdomains_)
    for (std::size_t n = 0; n < subdomain.sides.size(); ++n) {
      Side& side = subdomain.sides[n];
      if (side.local < 0) continue;
      const auto e = static_cast<std::int32_t>(&subdomain - subdomains_.data());
      for (const Side& back : subdomains_[at(side.local)].sides)
        if (back.local == e) side.source = back.link.out.data();
    }
  for (std::size_t e = 0; e < subdomains_.size() && all.several(); ++e)
    for (const CopySource& copy : all.interfaces[e].copies)
      subdomains_[e].sources.push_back(copy.neighbour < 0 ? nullptr
                                                          : subdomains_[e].sides[at(copy.neighbour)].source +
                                                                at(copy.place) * width_);
  plan_centre();
  count_messages();
}

void Gluing::plan_sides(std::size_t e) {
  const Decomposition& all = state_.decomposition;
  Subdomain& mine = subdomains_[e];
  mine.wall_copies.resize(walls_.size());
  if (!all.several()) return;
  const SubdomainInterface& interface = all.interfaces[e];
  const std::size_t begin = all.slot_begin[e];
  for (std::int32_t s : interface.shared) mine.shared.push_back(begin + at(s));
  if (settings_.coupling == Coupling::schwarz) mine.base.resize(mine.shared.size() * width_);
  mine.sides.resize(interface.neighbours.size());
  for (std::size_t n = 0; n < mine.sides.size(); ++n) {
    const Neighbour& neighbour = interface.neighbours[n];
    Side& side = mine.sides[n];
    for (std::int32_t k = neighbour.begin; k < neighbour.end; ++k)
      side.slots.push_back(begin + at(interface.exchange[at(k)]));
    const std::int32_t rank = all.rank_of[at(neighbour.subdomain)];
    const std::size_t length = side.slots.size() * width_;
    side.link.out.resize(length + 1);
    if (rank == ranks_.rank()) {
      side.local = static_cast<std::int32_t>(
          std::lower_bound(all.here.begin(), all.here.end(), neighbour.subdomain) - all.here.begin());
      continue;
    }
    side.link.in.resize(length + 1);
    side.source = side.link.in.data();
    const std::int32_t count = all.partition.subdomains;
    side.link.sender =
        ranks_.open_send(rank, tag_of(interface.subdomain, neighbour.subdomain, count), side.link.out);
    side.link.receiver =
        ranks_.open_receive(rank, tag_of(neighbour.subdomain, interface.subdomain, count), side.link.in);
    side.link.out_name = trace::message_name(static_cast<std::uint32_t>(interface.subdomain),
                                             static_cast<std::uint32_t>(neighbour.subdomain));
    side.link.in_name = trace::message_name(static_cast<std::uint32_t>(neighbour.subdomain),
                                            static_cast<std::uint32_t>(interface.subdomain));
    side.link.receiver->start();
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
  const Decomposition& all = state_.decomposition;
  for (std::size_t e = 0; e < subdomains_.size() && all.several(); ++e) {
    const Subdomain& subdomain = subdomains_[e];
    for (const Side& side : subdomain.sides) add(side.slots.size() * width_, side.local < 0);
    if (subdomain.partial.empty()) continue;
    add(subdomain.partial.size(), false);                                // to the centre
    add(3 * walls_.size() + subdomain.hub_item.size() * width_, false);  // and back
  }
  if (centre_ && centre_->up) {
    count[2] += 2;
    count[3] += static_cast<std::int64_t>(8 * (centre_->up->out.size() + centre_->up->in.size() - 2));
  }
  ranks_.sum(count);
  messages_ = {count[0], count[1], count[2], count[3]};
}

void Gluing::begin() {
  for (Subdomain& subdomain : subdomains_) {
    subdomain.waited = 0;
    for (auto& copies : subdomain.wall_copies) copies.clear();
  }
  if (centre_) centre_->waited = 0;
  std::vector<std::int64_t> copies(state_.walls.size(), 0);
  for (std::size_t w = 0; w < state_.walls.size(); ++w)
    copies[w] = static_cast<std::int64_t>(state_.wall_states[w].copies.size());
  if (!walls_.empty()) ranks_.sum(copies);
  for (std::size_t w = 0; w < state_.walls.size(); ++w) state_.wall_states[w].copies_everywhere = copies[w];
  for (std::size_t g = 0; g < walls_.size(); ++g)
    for (std::int32_t c : state_.wall_states[at(walls_[g])].copies)
      subdomains_[at(state_.chunks.subdomain[at(c)])].wall_copies[g].push_back(c);
}

std::vector<std::uint32_t> Gluing::readers_here(std::size_t e) const {
  std::vector<std::uint32_t> readers;
  for (const Side& side : subdomains_[e].sides)
    if (side.local >= 0) readers.push_back(static_cast<std::uint32_t>(side.local));
  return readers;
}

template <class Record>
void Gluing::publish_bodies(std::size_t e, std::span<const Record> velocity) {
  Subdomain& mine = subdomains_[e];
  for (Side& side : mine.sides) {
    if (side.link.sender) await(*side.link.sender, mine.waited, ranks_.trace(), side.link.out_name);
    if (width_ == 6)
      write_velocities<6>(velocity, side.slots, side.link.out.data());
    else
      write_velocities<3>(velocity, side.slots, side.link.out.data());
  }
  if (mine.hub_item.empty()) return;
  const SubdomainInterface& interface = state_.decomposition.interfaces[e];
  for (std::size_t h = 0; h < interface.hubs.size(); ++h)
    read_velocity(width_, velocity[mine.shared[at(interface.hubs[h])]],
                  &mine.partial[3 * walls_.size() + h * width_]);
}

void Gluing::publish(std::size_t e, Mode mode, bool single) {
  if (mode == Mode::local) return;
  Subdomain& mine = subdomains_[e];
  if (single)
    publish_bodies<SingleVelocity>(e, state_.single.velocity);
  else
    publish_bodies<Velocity>(e, state_.bodies.velocity);
  for (Side& side : mine.sides)
    if (side.link.sender) start(*side.link.sender, ranks_.trace(), side.link.out_name);
  for (std::size_t g = 0; g < walls_.size() && mode != Mode::sum; ++g) {
    double* sum = &mine.partial[3 * g];
    std::fill_n(sum, 3, 0.0);
    for (std::int32_t c : mine.wall_copies[g])
      for (std::size_t k = 0; k < 3; ++k) sum[k] += state_.copies[at(c)].velocity[k];
  }
  if (!centre_->up || !centre_->links.empty()) return;
  // The last of a leaf's subdomains sends for all: its count has seen what the others wrote.
  if (centre_->published.fetch_add(1, std::memory_order_acq_rel) + 1 < subdomains_.size()) return;
  centre_->published.store(0, std::memory_order_relaxed);
  send_up();
}

void Gluing::glue(std::size_t e, Mode mode, bool single) {
  Subdomain& mine = subdomains_[e];
  for (std::size_t g = 0; g < walls_.size() && mode != Mode::sum; ++g) {
    const auto& copies = mine.wall_copies[g];
    if (copies.empty()) continue;
    if (mode == Mode::local) {
      glue_copies(state_.copies, copies);
      continue;
    }
    const double part = 1 / static_cast<double>(state_.wall_states[at(walls_[g])].copies_everywhere);
    for (std::int32_t c : copies)
      for (std::size_t k = 0; k < 3; ++k) state_.copies[at(c)].velocity[k] = part * centre_->sums[3 * g + k];
  }
  if (mode == Mode::local || !state_.decomposition.several()) return;
  for (Side& side : mine.sides)
    if (side.link.receiver) await(*side.link.receiver, mine.waited, ranks_.trace(), side.link.in_name);
  if (single)
    glue_bodies<SingleVelocity>(e, mode, state_.single.velocity);
  else
    glue_bodies<Velocity>(e, mode, state_.bodies.velocity);
  for (Side& side : mine.sides)
    if (side.link.receiver) side.link.receiver->start();
}

template <class Record>
void Gluing::glue_bodies(std::size_t e, Mode mode, std::span<Record> velocity) {
  Subdomain& mine = subdomains_[e];
  const SubdomainInterface& interface = state_.decomposition.interfaces[e];
  const bool schwarz = settings_.coupling == Coupling::schwarz;
  JumpSums jump;
  // One shared body: the sum of its copies becomes what all copies go on with.
  const auto settle = [&](std::size_t s, const double* sum) {
    const std::size_t slot = mine.shared[s];
    Record& v = velocity[slot];
    const double m = state_.decomposition.multiplicity[slot];
    std::array<double, 6> next{};
    double* base = schwarz ? &mine.base[s * width_] : nullptr;
    if (schwarz && mode == Mode::fresh)
      for (std::size_t k = 0; k < width_; ++k)
        base[k] = k < 3 ? state_.free.u[slot][k] : state_.free.w[slot][k - 3];
    for (std::size_t k = 0; k < width_; ++k)
      next[k] = mode == Mode::sum ? sum[k] : schwarz ? base[k] + (sum[k] - m * base[k]) : sum[k] / m;
    if (mode == Mode::measured) {
      const auto& whole = state_.decomposition.whole[slot];
      for (std::size_t k = 0; k < width_; ++k) {
        const double mobility = whole[k < 3 ? 0 : 1];
        if (mobility == 0) continue;
        const double now = k < 3 ? v.u[k] : v.w[k - 3];
        jump.jump2 += (now - next[k]) * (now - next[k]) / (m * mobility);
        jump.velocity2 += next[k] * next[k] / (m * mobility);
      }
    }
    assign(width_, next.data(), v);
    if (schwarz && mode != Mode::sum) std::copy_n(next.begin(), width_, base);
  };
  if (!schwarz && mode != Mode::measured && mode != Mode::sum) {
    const auto means = width_ == 6 ? take_means<6, Record> : take_means<3, Record>;
    means(velocity, mine.shared, interface.copies_begin, mine.sources.data());
  } else {
    for (std::size_t s = 0; s < interface.shared.size(); ++s) {
      const auto begin = at(interface.copies_begin[s]), end = at(interface.copies_begin[s + 1]);
      if (begin == end) continue;  // a hub
      std::array<double, 6> sum{}, own;
      read_velocity(width_, velocity[mine.shared[s]], own.data());
      for (std::size_t c = begin; c < end; ++c) {
        const double* const from = mine.sources[c] ? mine.sources[c] : own.data();
        for (std::size_t k = 0; k < width_; ++k) sum[k] += from[k];
      }
      settle(s, sum.data());
    }
  }
  for (std::size_t h = 0; h < interface.hubs.size(); ++h)
    settle(at(interface.hubs[h]), &centre_->sums[3 * walls_.size() + mine.hub_item[h] * width_]);
  if (mode == Mode::measured) jumps_[e] = jump;
}

/// The velocities of the shared copies lend themselves as what is exchanged.
void Gluing::sum_copies(std::span<std::vector<Twist>> field) {
  const Decomposition& all = state_.decomposition;
  const auto each_shared = [&](const auto& work) {
    std::size_t k = 0;
    for (std::size_t e = 0; e < subdomains_.size(); ++e)
      for (const std::size_t slot : subdomains_[e].shared)
        work(state_.bodies.velocity[slot], field[e][slot - all.slot_begin[e]], k++);
  };
  const auto wall = [&](std::size_t e, std::size_t g) -> Vec3& {
    return field[e][field[e].size() - walls_.size() + g].u;
  };
  kept_.clear();
  each_shared([&](Velocity& v, const Twist& twist, std::size_t) {
    kept_.push_back(v);
    std::copy_n(twist.u.data(), 3, v.u);
    std::copy_n(twist.w.data(), 3, v.w);
  });
  for (std::size_t e = 0; e < subdomains_.size(); ++e) {
    for (std::size_t g = 0; g < walls_.size(); ++g)
      std::copy_n(wall(e, g).data(), 3, &subdomains_[e].partial[3 * g]);
    publish(e, Mode::sum);
  }
  if (tasks_of_rank() > 1) collect(Mode::sum);
  centre(Mode::sum);
  for (std::size_t e = 0; e < subdomains_.size(); ++e) {
    glue(e, Mode::sum);
    for (std::size_t g = 0; g < walls_.size(); ++g)
      wall(e, g) = Eigen::Map<const Vec3>(&centre_->sums[3 * g]);
  }
  each_shared([&](Velocity& v, Twist& twist, std::size_t k) {
    std::copy_n(v.u, 3, twist.u.data());
    if (width_ == 6) std::copy_n(v.w, 3, twist.w.data());
    v = kept_[k];
  });
}

std::vector<trace::Message> Gluing::message_plan() const {
  const Decomposition& all = state_.decomposition;
  std::vector<trace::Message> plan;
  const auto add = [&](std::int32_t from, std::int32_t to, std::size_t doubles) {
    plan.push_back({static_cast<std::uint16_t>(from), static_cast<std::uint16_t>(to),
                    static_cast<std::uint32_t>(8 * doubles)});
  };
  for (std::size_t e = 0; e < subdomains_.size() && all.several(); ++e) {
    const Subdomain& subdomain = subdomains_[e];
    for (std::size_t n = 0; n < subdomain.sides.size(); ++n)
      add(all.here[e], all.interfaces[e].neighbours[n].subdomain, subdomain.sides[n].slots.size() * width_);
    if (subdomain.partial.empty()) continue;
    add(all.here[e], trace::centre_group, subdomain.partial.size());
    add(trace::centre_group, all.here[e], 3 * walls_.size() + subdomain.hub_item.size() * width_);
  }
  return plan;
}

double Gluing::exposed() const {
  double sum = centre_ ? centre_->waited : 0;
  for (const Subdomain& subdomain : subdomains_) sum += subdomain.waited;
  return sum;
}

}  // namespace talus
