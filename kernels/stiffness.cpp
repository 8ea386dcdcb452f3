#include "kernels/stiffness.hpp"

namespace talus {

namespace {

std::size_t at(std::int32_t k) {
  return static_cast<std::size_t>(k);
}

/// One part's bodies by their distance over contacts from the driven walls.
struct Layers {
  std::vector<std::size_t> begin;                ///< per unknown + 1, into `other`
  std::vector<std::int32_t> other;               ///< neighbours, in order of contact
  std::vector<std::int32_t> depth;               ///< per unknown; -1: not reached
  std::vector<std::vector<std::int32_t>> layer;  ///< unknowns by depth
  std::vector<std::int32_t> met;                 ///< unknowns whose mark may have been set
  std::vector<double> parts, load;               ///< contacts with the layer below; what is handed on [kg]

  explicit Layers(const BodyProblem& problem)
      : begin(problem.bodies.size() + 1, 0), depth(problem.bodies.size(), -1) {
    for (const ContactEquation& c : problem.contacts)
      if (c.second >= 0) {
        ++begin[at(c.first) + 1];
        ++begin[at(c.second) + 1];
      }
    for (std::size_t b = 0; b + 1 < begin.size(); ++b) begin[b + 1] += begin[b];
    other.resize(begin.back());
    std::vector<std::size_t> next(begin.begin(), begin.end() - 1);
    for (const ContactEquation& c : problem.contacts)
      if (c.second >= 0) {
        other[next[at(c.first)]++] = c.second;
        other[next[at(c.second)]++] = c.first;
      }
  }
  std::span<const std::int32_t> neighbours(std::int32_t body) const {
    return std::span(other).subspan(begin[at(body)], begin[at(body) + 1] - begin[at(body)]);
  }
  bool below(std::int32_t from, std::int32_t to) const {
    return to < 0 ? depth[at(from)] == 1 : depth[at(to)] == depth[at(from)] - 1;
  }
};

/// Unknowns marked in any part are the layer `depth`, those that have none yet. False when there are none.
bool take_layer(const BodyParts& parts, std::vector<Layers>& layers, PartField& mark, std::int32_t depth) {
  parts.link().sum_copies(mark);
  return parts.total(1, [&](std::size_t p, std::span<double> row) {
    Layers& here = layers[p];
    std::vector<std::int32_t>& layer = here.layer.emplace_back();
    const auto take = [&](std::int32_t b) {
      if (mark[p][at(b)].u[0] > 0 && here.depth[at(b)] < 0) {
        here.depth[at(b)] = depth;
        layer.push_back(b);
      }
      mark[p][at(b)].u[0] = 0;
    };
    for (std::int32_t b : here.met) take(b);
    for (std::int32_t b : parts[p].shared) take(b);
    here.met.clear();
    row[0] = static_cast<double>(layer.size());
  })[0] > 0;
}

/// Without a driven wall: what the others come to rest on.
void mark_heaviest(const BodyParts& parts, std::vector<Layers>& layers, PartField& mark) {
  std::vector<std::size_t> heaviest(parts.size());
  const std::vector<double> masses = parts.rows(1, [&](std::size_t p, std::span<double> row) {
    for (std::size_t b = 0; b < parts[p].bodies.size(); ++b)
      if (parts[p].counted(b) && parts[p].bodies[b].mass > row[0]) {
        row[0] = parts[p].bodies[b].mass;
        heaviest[p] = b;
      }
  });
  std::size_t most = 0;
  for (std::size_t k = 1; k < masses.size(); ++k)
    if (masses[k] > masses[most]) most = k;
  for (std::size_t p = 0; p < parts.size(); ++p)
    if (at(parts[p].subdomain) == most && masses[most] > 0) {
      mark[p][heaviest[p]].u[0] = 1;
      layers[p].met.push_back(static_cast<std::int32_t>(heaviest[p]));
    }
}

/// Returns the largest depth.
std::int32_t find_layers(const BodyParts& parts, std::vector<Layers>& layers) {
  PartField mark = parts.field();
  parts.each([&](std::size_t p) {
    layers[p].layer.emplace_back();  // depth 0
    for (const ContactEquation& c : parts[p].contacts)
      if (c.second < 0) {
        mark[p][at(c.first)].u[0] = 1;
        layers[p].met.push_back(c.first);
      }
  });
  std::int32_t depth = 1;
  if (!take_layer(parts, layers, mark, depth)) {
    for (Layers& here : layers) here.layer.clear();
    mark_heaviest(parts, layers, mark);
    depth = 0;
    if (!take_layer(parts, layers, mark, depth)) return 0;
  }
  for (;;) {
    parts.each([&](std::size_t p) {
      Layers& here = layers[p];
      for (std::int32_t b : here.layer[at(depth)])
        for (std::int32_t other : here.neighbours(b))
          if (here.depth[at(other)] < 0 && mark[p][at(other)].u[0] == 0) {
            mark[p][at(other)].u[0] = 1;
            here.met.push_back(other);
          }
    });
    if (!take_layer(parts, layers, mark, depth + 1)) return depth;
    ++depth;
  }
}

/// Inwards, each body hands what it carries to its contacts of the layer below, in equal parts.
void hand_on(const BodyParts& parts, std::vector<Layers>& layers, std::int32_t deepest) {
  PartField gain = parts.field();
  parts.each([&](std::size_t p) {
    const Layers& here = layers[p];
    for (const ContactEquation& c : parts[p].contacts) {
      if (here.below(c.first, c.second)) ++gain[p][at(c.first)].u[0];
      if (c.second >= 0 && here.below(c.second, c.first)) ++gain[p][at(c.second)].u[0];
    }
  });
  parts.link().sum_copies(gain);
  parts.each([&](std::size_t p) {
    Layers& here = layers[p];
    for (std::size_t b = 0; b < here.depth.size(); ++b) {
      here.parts.push_back(gain[p][b].u[0]);
      here.load.push_back(here.depth[b] >= 1 ? parts[p].bodies[b].mass : 0);
      gain[p][b] = Twist{};
    }
  });
  for (std::int32_t depth = deepest; depth > 1; --depth) {
    parts.each([&](std::size_t p) {
      Layers& here = layers[p];
      here.met.clear();
      for (std::int32_t b : here.layer[at(depth)])
        for (std::int32_t other : here.neighbours(b))
          if (here.depth[at(other)] == depth - 1) {
            gain[p][at(other)].u[0] += here.load[at(b)] / here.parts[at(b)];
            here.met.push_back(other);
          }
    });
    parts.link().sum_copies(gain);
    parts.each([&](std::size_t p) {
      Layers& here = layers[p];
      const auto take = [&](std::int32_t b) {
        here.load[at(b)] += gain[p][at(b)].u[0];
        gain[p][at(b)].u[0] = 0;
      };
      for (std::int32_t b : here.met) take(b);
      for (std::int32_t b : parts[p].shared) take(b);
    });
  }
}

}  // namespace

double stiffness_of(const BodyProblem& problem, std::span<const Vec3> impulse) {
  std::vector<Twist> gained = velocities_of(problem, impulse);
  double kinetic = 0;
  for (std::size_t b = 0; b < gained.size(); ++b) {
    const BodyUnknown& body = problem.bodies[b];
    kinetic += body.mass * (gained[b].u - body.free.u).squaredNorm() +
               body.spin_mass * (gained[b].w - body.free.w).squaredNorm();
  }
  double sum = 0;
  for (std::size_t k = 0; k < impulse.size(); ++k)
    sum += impulse[k].squaredNorm() / effective_mass(problem, problem.contacts[k]);
  return kinetic > 0 ? sum / kinetic : 0;
}

double estimate_stiffness(const BodyParts& parts) {
  std::vector<Layers> layers;
  for (std::size_t p = 0; p < parts.size(); ++p) layers.emplace_back(parts[p]);
  hand_on(parts, layers, find_layers(parts, layers));
  const std::vector<double> sums = parts.total(2, [&](std::size_t p, std::span<double> row) {
    const BodyProblem& problem = parts[p];
    const Layers& here = layers[p];
    for (const ContactEquation& c : problem.contacts) {
      double r = 0;
      if (here.below(c.first, c.second)) r = here.load[at(c.first)] / here.parts[at(c.first)];
      if (c.second >= 0 && here.below(c.second, c.first))
        r = here.load[at(c.second)] / here.parts[at(c.second)];
      row[0] += r * r / effective_mass(problem, c);
    }
    for (std::size_t b = 0; b < problem.bodies.size(); ++b)
      if (problem.counted(b) && here.depth[b] >= 1) row[1] += problem.bodies[b].mass;
  });
  return sums[1] > 0 ? sums[0] / sums[1] : 0;
}

double estimate_stiffness(const BodyProblem& problem) {
  const PartLink alone;
  return estimate_stiffness(BodyParts({&problem, 1}, alone));
}

}  // namespace talus
