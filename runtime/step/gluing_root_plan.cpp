/// The tree of ranks that leads to the root of the gluing: what each rank sends to its parent and
/// receives from it.

#include <algorithm>
#include <utility>

#include "runtime/step/detail/gluing_parts.hpp"

namespace talus {

using detail::Link;
using detail::root_tag;

/// What all ranks know of the root's messages. Lengths are in doubles.
struct Gluing::RootTraffic {
  /// A body that goes through the root, as a subdomain names it.
  struct Hub {
    SubdomainId subdomain;
    std::int64_t id;
  };
  std::vector<Hub> hubs;                    ///< of all subdomains, one after the other
  Per<SubdomainId, std::size_t> length;     ///< of the part of a subdomain
  std::vector<std::size_t> length_of_rank;  ///< of the parts of its subdomains together

  bool none() const {
    return std::ranges::all_of(length, [](std::size_t of) { return of == 0; });
  }
  std::size_t length_of(const std::vector<int>& branch) const {
    std::size_t sum = 0;
    for (const int rank : branch) sum += length_of_rank[at(rank)];
    return sum;
  }
};

namespace {

/// Place of a body among the results, which go by ascending id.
std::size_t place_of(const std::vector<std::int64_t>& ids, std::int64_t id) {
  return static_cast<std::size_t>(std::lower_bound(ids.begin(), ids.end(), id) - ids.begin());
}

}  // namespace

void Gluing::plan_tree(std::uint64_t contacts) {
  graph::RankLoad load{contacts, false};
  for (const SubdomainPlace e : subdomains_.indices()) {
    load.waits = load.waits || (needed_ && subdomain_colour(e) > 0);
    load.work += graph::load_of_neighbour * subdomains_[e].sides.size();
  }
  tree_ = graph::grow_tree(ranks_.gather_records(std::span<const graph::RankLoad>(&load, 1)));
  if (!needed_) return;
  const RootTraffic traffic = gather_traffic();
  root_ = std::make_unique<Root>();
  plan_parts(traffic);
  if (ranks_.ranks() > 1 && !traffic.none()) open_links(traffic);
  count_messages();
  if (ranks_.rank() == tree_.top()) find_contributions(traffic);
}

/// Gathers the names of all hubs on every rank: a few words per hub, none in most scenes. Collective.
Gluing::RootTraffic Gluing::gather_traffic() const {
  const Decomposition& all = state_.decomposition;
  std::vector<RootTraffic::Hub> mine;
  for (const SubdomainPlace e : all.interfaces.indices())
    for (std::int32_t hub : all.interfaces[e].hubs) {
      const std::size_t slot = at(subdomains_[e].shared[at(hub)]);
      mine.push_back({all.here[e], static_cast<std::int64_t>(state_.bodies.id[slot])});
    }
  RootTraffic traffic;
  traffic.hubs = ranks_.gather_records(std::span<const RootTraffic::Hub>(mine));
  std::ranges::stable_sort(traffic.hubs, {}, &RootTraffic::Hub::subdomain);
  traffic.length.assign(at(all.partition.subdomains), 3 * vectors());
  for (const auto& hub : traffic.hubs) traffic.length[hub.subdomain] += width_;
  traffic.length_of_rank.assign(at(ranks_.ranks()), 0);
  for (const SubdomainId e : traffic.length.indices())
    traffic.length_of_rank[at(all.rank_of[e])] += traffic.length[e];
  return traffic;
}

/// Ids of the bodies whose sums the rank `top` or one below it asks for: ascending, each once.
std::vector<std::int64_t> Gluing::items_below(const RootTraffic& traffic, int top) const {
  const std::vector<int> branch = tree_.branch(top);
  std::vector<std::int64_t> ids;
  for (const auto& [subdomain, id] : traffic.hubs)
    if (const int rank = state_.decomposition.rank_of[subdomain];
        std::ranges::find(branch, rank) != branch.end())
      ids.push_back(id);
  std::ranges::sort(ids);
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  return ids;
}

/// Buffers of the parts of the subdomains here, and of the root's results.
void Gluing::plan_parts(const RootTraffic& traffic) {
  const Decomposition& all = state_.decomposition;
  const std::vector<std::int64_t> items = items_below(traffic, ranks_.rank());
  root_->sums.resize(3 * vectors() + items.size() * width_);
  for (const SubdomainPlace e : all.here.indices()) {
    Subdomain& subdomain = subdomains_[e];
    subdomain.partial.resize(traffic.length[all.here[e]]);
    for (const auto& hub : traffic.hubs)
      if (hub.subdomain == all.here[e]) subdomain.hub_item.push_back(place_of(items, hub.id));
  }
}

/// Channels to this rank's children and its parent.
void Gluing::open_links(const RootTraffic& traffic) {
  const Per<SubdomainId, std::int32_t>& rank_of = state_.decomposition.rank_of;
  const int me = ranks_.rank();
  // In a trace a message is named after the first subdomain of the child and the root, whose part the parent
  // takes.
  const auto open = [&](int child, std::size_t out, std::size_t in) {
    const int other = child == me ? tree_.parent[at(me)] : child;
    auto link = std::make_unique<Link>();
    link->out.resize(out);
    link->in.resize(in);
    link->sender = ranks_.open_send(other, root_tag, link->out);
    link->receiver = ranks_.open_receive(other, root_tag, link->in);
    const auto first = static_cast<std::uint32_t>(std::ranges::find(rank_of, child) - rank_of.begin());
    link->out_name = trace::message_name(first, trace::root_group);
    link->in_name = trace::message_name(trace::root_group, first);
    if (me != child) std::swap(link->out_name, link->in_name);
    link->receiver->start();
    return link;
  };
  const std::vector<std::int64_t> items = items_below(traffic, me);
  for (const int child : tree_.children[at(me)]) {
    std::vector<std::size_t>& wanted = root_->items_of_child.emplace_back();
    for (std::int64_t id : items_below(traffic, child)) wanted.push_back(place_of(items, id));
    root_->links.push_back(
        open(child, 3 * vectors() + wanted.size() * width_, traffic.length_of(tree_.branch(child))));
  }
  if (me != tree_.top()) root_->up = open(me, traffic.length_of(tree_.branch(me)), root_->sums.size());
}

/// On the top: finds where the part of each subdomain arrives, in a message of a child or here, and which
/// sums it adds to.
void Gluing::find_contributions(const RootTraffic& traffic) {
  const Decomposition& all = state_.decomposition;
  const int me = ranks_.rank();
  // Of each rank: where its part begins in the message of its branch.
  std::vector<const double*> parts(at(ranks_.ranks()), nullptr);
  for (std::size_t child = 0; child < root_->links.size(); ++child) {
    const double* from = root_->links[child]->in.data();
    for (const int rank : tree_.branch(tree_.children[at(me)][child])) {
      parts[at(rank)] = from;
      from += traffic.length_of_rank[at(rank)];
    }
  }
  const std::vector<std::int64_t> items = items_below(traffic, me);
  for (const SubdomainId e : traffic.length.indices()) {
    Root::Contribution contribution;
    const std::int32_t rank = all.rank_of[e];
    if (rank == me) {
      contribution.partial = subdomains_[all.place_of(e)].partial.data();
    } else if (const double*& from = parts[at(rank)]) {
      contribution.partial = from;
      from += traffic.length[e];
    }
    for (const auto& hub : traffic.hubs)
      if (hub.subdomain == e) contribution.item.push_back(place_of(items, hub.id));
    root_->contributions.push_back(std::move(contribution));
  }
}

}  // namespace talus
