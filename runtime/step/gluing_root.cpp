/// The root of the gluing, and the tree of ranks that leads to it and back.

#include <algorithm>
#include <ranges>
#include <utility>

#include "runtime/step/detail/gluing_parts.hpp"

namespace talus {

using detail::at;
using detail::await;
using detail::Link;
using detail::root_tag;
using detail::start;

void Gluing::plan_tree(std::uint64_t contacts) {
  const Decomposition& all = state_.decomposition;
  graph::RankLoad load{contacts, false};
  for (std::size_t e = 0; e < subdomains_.size(); ++e)
    load.waits = load.waits || (needed_ && subdomain_colour(e) > 0);
  for (const Subdomain& subdomain : subdomains_)
    load.work += graph::load_of_neighbour * subdomain.sides.size();
  tree_ = graph::grow_tree(ranks_.gather_records(std::span<const graph::RankLoad>(&load, 1)));
  if (!needed_) return;
  /// A body that goes through the root, as a subdomain names it.
  struct HubRecord {
    std::int64_t subdomain;
    std::int64_t id;
  };
  std::vector<HubRecord> mine;
  for (std::size_t e = 0; e < all.here.size() && all.several(); ++e) {
    const SubdomainInterface& interface = all.interfaces[e];
    for (std::int32_t hub : interface.hubs) {
      const std::size_t slot = at(subdomains_[e].shared[at(hub)]);
      mine.push_back({all.here[e], static_cast<std::int64_t>(state_.bodies.id[slot])});
    }
  }
  // Every rank learns all names: a few words per hub, none in most scenes.
  std::vector<HubRecord> everywhere = ranks_.gather_records(std::span<const HubRecord>(mine));
  std::stable_sort(everywhere.begin(), everywhere.end(),
                   [](const HubRecord& a, const HubRecord& b) { return a.subdomain < b.subdomain; });
  const auto place = [](const std::vector<std::int64_t>& ids, std::int64_t id) {
    return static_cast<std::size_t>(std::lower_bound(ids.begin(), ids.end(), id) - ids.begin());
  };
  const int me = ranks_.rank(), ranks = ranks_.ranks();
  const std::vector<int>& children = tree_.children[at(me)];
  const auto items_below = [&](int top) {
    const std::vector<int> branch = tree_.branch(top);
    std::vector<std::int64_t> ids;
    for (const HubRecord& record : everywhere)
      if (std::ranges::find(branch, all.rank_of[static_cast<std::size_t>(record.subdomain)]) != branch.end())
        ids.push_back(record.id);
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    return ids;
  };
  const std::vector<std::int64_t> items = items_below(me);
  const std::size_t at_walls = 3 * walls_.size();
  root_ = std::make_unique<Root>();
  Root& root = *root_;
  root.sums.resize(at_walls + items.size() * width_);
  std::vector<std::size_t> length(at(all.partition.subdomains), at_walls);
  for (const HubRecord& record : everywhere) length[static_cast<std::size_t>(record.subdomain)] += width_;
  for (std::size_t e = 0; e < all.here.size(); ++e) {
    Subdomain& subdomain = subdomains_[e];
    subdomain.partial.resize(length[at(all.here[e])]);
    for (const HubRecord& record : everywhere)
      if (record.subdomain == all.here[e]) subdomain.hub_item.push_back(place(items, record.id));
  }
  std::vector<std::size_t> length_of_rank(static_cast<std::size_t>(ranks), 0);
  for (std::size_t e = 0; e < length.size(); ++e) length_of_rank[at(all.rank_of[e])] += length[e];
  if (ranks > 1 && (at_walls > 0 || !everywhere.empty())) {
    const auto length_of_branch = [&](int top) {
      std::size_t sum = 0;
      for (const int rank : tree_.branch(top)) sum += length_of_rank[at(rank)];
      return sum;
    };
    // A message is named after the first subdomain of the child; its parent speaks for the root.
    const auto open = [&](int child, std::size_t out, std::size_t in) {
      const int other = child == me ? tree_.parent[at(me)] : child;
      auto link = std::make_unique<Link>();
      link->out.resize(out);
      link->in.resize(in);
      link->sender = ranks_.open_send(other, root_tag, link->out);
      link->receiver = ranks_.open_receive(other, root_tag, link->in);
      const auto first = static_cast<std::uint32_t>(std::find(all.rank_of.begin(), all.rank_of.end(), child) -
                                                    all.rank_of.begin());
      link->out_name = trace::message_name(first, trace::root_group);
      link->in_name = trace::message_name(trace::root_group, first);
      if (me != child) std::swap(link->out_name, link->in_name);
      link->receiver->start();
      return link;
    };
    for (const int child : children) {
      std::vector<std::size_t>& wanted = root.items_of_child.emplace_back();
      for (std::int64_t id : items_below(child)) wanted.push_back(place(items, id));
      root.links.push_back(open(child, at_walls + wanted.size() * width_, length_of_branch(child)));
    }
    if (me != tree_.top()) root.up = open(me, length_of_branch(me), root.sums.size());
  }
  count_messages();
  if (me != tree_.top()) return;
  // Where the parts of each rank come: the message of its branch, and where in it.
  std::vector<const double*> parts(static_cast<std::size_t>(ranks), nullptr);
  for (std::size_t child = 0; child < root.links.size(); ++child) {
    const double* from = root.links[child]->in.data();
    for (const int rank : tree_.branch(children[child])) {
      parts[at(rank)] = from;
      from += length_of_rank[at(rank)];
    }
  }
  for (std::size_t e = 0; e < length.size(); ++e) {
    Root::Contribution contribution;
    const std::int32_t rank = all.rank_of[e];
    if (rank == me) {
      const auto local = std::lower_bound(all.here.begin(), all.here.end(), static_cast<std::int32_t>(e));
      contribution.partial = subdomains_[static_cast<std::size_t>(local - all.here.begin())].partial.data();
    } else if (const double*& from = parts[at(rank)]) {
      contribution.partial = from;
      from += length[e];
    }
    for (const HubRecord& record : everywhere)
      if (record.subdomain == static_cast<std::int64_t>(e))
        contribution.item.push_back(place(items, record.id));
    root.contributions.push_back(std::move(contribution));
  }
}

bool Gluing::collects() const {
  return root_ && root_->up && !root_->links.empty();
}

/// The parts of this rank's subdomains, then the messages of its children as they came.
void Gluing::send_up() {
  Link& link = *root_->up;
  await(*link.sender, root_->waited, ranks_.trace(), link.out_name);
  auto out = link.out.begin();
  for (const Subdomain& subdomain : subdomains_)
    out = std::copy(subdomain.partial.begin(), subdomain.partial.end(), out);
  for (const auto& child : root_->links) out = std::copy(child->in.begin(), child->in.end(), out);
  start(*link.sender, ranks_.trace(), link.out_name);
}

/// The last to be told comes first: it has least below it.
void Gluing::await_children() {
  for (const auto& link : root_->links | std::views::reverse)
    await(*link->receiver, root_->waited, ranks_.trace(), link->in_name);
}

void Gluing::collect(Mode mode) {
  if (mode == Mode::local) return;
  await_children();
  send_up();
  for (const auto& link : root_->links) link->receiver->start();
}

void Gluing::root(Mode mode) {
  Root& root = *root_;
  // A rank whose subdomains have nothing to sum takes what its parent sends all the same, and passes it on.
  if (mode == Mode::local || (root.sums.empty() && !root.up && root.links.empty())) return;
  if (root.up) {
    Link& link = *root.up;
    await(*link.receiver, root.waited, ranks_.trace(), link.in_name);
    std::copy_n(link.in.begin(), root.sums.size(), root.sums.begin());
    link.receiver->start();
    answer();
    return;
  }
  await_children();
  std::fill(root.sums.begin(), root.sums.end(), 0.0);
  const std::size_t at_walls = 3 * walls_.size();
  for (const Root::Contribution& contribution : root.contributions) {
    for (std::size_t k = 0; k < at_walls; ++k) root.sums[k] += contribution.partial[k];
    for (std::size_t h = 0; h < contribution.item.size(); ++h)
      for (std::size_t k = 0; k < width_; ++k)
        root.sums[at_walls + contribution.item[h] * width_ + k] +=
            contribution.partial[at_walls + h * width_ + k];
  }
  for (const auto& link : root.links) link->receiver->start();
  answer();
}

/// To each child what its branch asks for.
void Gluing::answer() {
  const Root& root = *root_;
  const std::size_t at_walls = 3 * walls_.size();
  for (std::size_t child = 0; child < root.links.size(); ++child) {
    Link& link = *root.links[child];
    await(*link.sender, root_->waited, ranks_.trace(), link.out_name);
    auto out = std::copy_n(root.sums.begin(), at_walls, link.out.begin());
    for (std::size_t item : root.items_of_child[child])
      out =
          std::copy_n(root.sums.begin() + static_cast<std::ptrdiff_t>(at_walls + item * width_), width_, out);
    start(*link.sender, ranks_.trace(), link.out_name);
  }
}

}  // namespace talus
