/// Exchange through one rank: up the tree of ranks to the root of the gluing, and back.

#include <algorithm>

#include "runtime/step/detail/gluing_parts.hpp"

namespace talus {

using detail::await;
using detail::Link;
using detail::start;

bool Gluing::collects() const {
  return root_ && root_->up && !root_->links.empty();
}

/// Sends up the parts of this rank's subdomains, then the messages of its children as they came.
void Gluing::send_up() {
  Link& link = *root_->up;
  await(*link.sender, root_->waited, ranks_.trace(), link.out_name);
  auto out = link.out.begin();
  for (const Subdomain& subdomain : subdomains_)
    out = std::copy(subdomain.partial.begin(), subdomain.partial.end(), out);
  for (const auto& child : root_->links) out = std::copy(child->in.begin(), child->in.end(), out);
  start(*link.sender, ranks_.trace(), link.out_name);
}

/// In reverse order: the child that is told last has the fewest ranks below it, so its message comes first.
void Gluing::await_children() {
  for (auto link = root_->links.rbegin(); link != root_->links.rend(); ++link)
    await(*(*link)->receiver, root_->waited, ranks_.trace(), (*link)->in_name);
}

void Gluing::collect(Mode mode) {
  if (mode == Mode::local) return;
  await_children();
  send_up();
  for (const auto& link : root_->links) link->receiver->start();
}

void Gluing::root(Mode mode) {
  Root& root = *root_;
  // A rank whose subdomains have nothing to sum still receives its parent's message, and passes it on.
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
  const std::size_t at_walls = 3 * vectors();
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

/// Sends to each child the sums that its branch asks for.
void Gluing::answer() {
  const Root& root = *root_;
  const std::size_t at_walls = 3 * vectors();
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
