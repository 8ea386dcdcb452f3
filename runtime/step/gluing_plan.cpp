/// Who tells whom what in an exchange: sides, the centre, and their channels.

#include <algorithm>
#include <array>

#include "runtime/step/detail/gluing_parts.hpp"

namespace talus {

namespace {

std::size_t at(std::int32_t k) {
  return static_cast<std::size_t>(k);
}

constexpr int centre_tag = 1;
int tag_of(std::int32_t from, std::int32_t to, std::int32_t subdomains) {
  return 2 + from * subdomains + to;
}

}  // namespace

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

void Gluing::plan_centre() {
  const Decomposition& all = state_.decomposition;
  /// A body that goes through the centre, as a subdomain names it.
  struct HubRecord {
    std::int64_t subdomain;
    std::int64_t id;
  };
  std::vector<HubRecord> mine;
  for (std::size_t e = 0; e < all.here.size() && all.several(); ++e) {
    const SubdomainInterface& interface = all.interfaces[e];
    for (std::int32_t hub : interface.hubs) {
      const std::size_t slot = subdomains_[e].shared[at(hub)];
      mine.push_back({all.here[e], static_cast<std::int64_t>(state_.bodies.id[slot])});
    }
  }
  // Every rank learns all names: a few words per hub, none in most scenes.
  std::vector<HubRecord> everywhere = ranks_.gather_records(std::span<const HubRecord>(mine));
  std::stable_sort(everywhere.begin(), everywhere.end(),
                   [](const HubRecord& a, const HubRecord& b) { return a.subdomain < b.subdomain; });
  const auto items_of = [&](auto wanted) {
    std::vector<std::int64_t> ids;
    for (const HubRecord& record : everywhere)
      if (wanted(all.rank_of[static_cast<std::size_t>(record.subdomain)])) ids.push_back(record.id);
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    return ids;
  };
  const auto place = [](const std::vector<std::int64_t>& ids, std::int64_t id) {
    return static_cast<std::size_t>(std::lower_bound(ids.begin(), ids.end(), id) - ids.begin());
  };
  const bool is_centre = ranks_.rank() == 0;
  const std::vector<std::int64_t> items =
      items_of([&](std::int32_t rank) { return is_centre || rank == ranks_.rank(); });
  const std::size_t at_walls = 3 * walls_.size();
  centre_ = std::make_unique<Centre>();
  Centre& centre = *centre_;
  centre.sums.resize(at_walls + items.size() * width_);
  std::vector<std::size_t> length(at(all.partition.subdomains), at_walls);
  for (const HubRecord& record : everywhere) length[static_cast<std::size_t>(record.subdomain)] += width_;
  for (std::size_t e = 0; e < all.here.size(); ++e) {
    Subdomain& subdomain = subdomains_[e];
    subdomain.partial.resize(length[at(all.here[e])]);
    for (const HubRecord& record : everywhere)
      if (record.subdomain == all.here[e]) subdomain.hub_item.push_back(place(items, record.id));
  }
  if (ranks_.ranks() > 1 && (at_walls > 0 || !everywhere.empty())) {
    const auto open = [&](int other, std::size_t out, std::size_t in) {
      auto link = std::make_unique<Link>();
      link->out.resize(out + 1);
      link->in.resize(in + 1);
      link->sender = ranks_.open_send(other, centre_tag, link->out);
      link->receiver = ranks_.open_receive(other, centre_tag, link->in);
      // A rank is named after its first subdomain; 0 is the centre.
      const int named = is_centre ? other : ranks_.rank();
      const auto first = static_cast<std::uint32_t>(std::find(all.rank_of.begin(), all.rank_of.end(), named) -
                                                    all.rank_of.begin());
      link->out_name = trace::message_name(first, trace::centre_group);
      link->in_name = trace::message_name(trace::centre_group, first);
      if (is_centre) std::swap(link->out_name, link->in_name);
      link->receiver->start();
      return link;
    };
    const auto length_of_rank = [&](int rank) {
      std::size_t sum = 0;
      for (std::size_t e = 0; e < length.size(); ++e)
        if (all.rank_of[e] == rank) sum += length[e];
      return sum;
    };
    if (is_centre) {
      for (int rank = 1; rank < ranks_.ranks(); ++rank) {
        std::vector<std::size_t>& wanted = centre.items_of_rank.emplace_back();
        for (std::int64_t id : items_of([&](std::int32_t r) { return r == rank; }))
          wanted.push_back(place(items, id));
        centre.links.push_back(open(rank, at_walls + wanted.size() * width_, length_of_rank(rank)));
      }
    } else {
      centre.to_centre = open(0, length_of_rank(ranks_.rank()), centre.sums.size());
    }
  }
  if (!is_centre) return;
  std::vector<std::size_t> read_of_rank(static_cast<std::size_t>(ranks_.ranks()), 0);
  for (std::size_t e = 0; e < length.size(); ++e) {
    Centre::Contribution contribution;
    const std::int32_t rank = all.rank_of[e];
    if (rank == 0) {
      const auto local = std::lower_bound(all.here.begin(), all.here.end(), static_cast<std::int32_t>(e));
      contribution.partial = subdomains_[static_cast<std::size_t>(local - all.here.begin())].partial.data();
    } else if (!centre.links.empty()) {
      contribution.partial = centre.links[at(rank - 1)]->in.data() + read_of_rank[at(rank)];
      read_of_rank[at(rank)] += length[e];
    }
    for (const HubRecord& record : everywhere)
      if (record.subdomain == static_cast<std::int64_t>(e))
        contribution.item.push_back(place(items, record.id));
    centre.contributions.push_back(std::move(contribution));
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
  if (centre_ && centre_->to_centre) {
    count[2] += 2;
    count[3] +=
        static_cast<std::int64_t>(8 * (centre_->to_centre->out.size() + centre_->to_centre->in.size() - 2));
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

}  // namespace talus
