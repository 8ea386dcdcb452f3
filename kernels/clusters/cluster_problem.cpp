#include "kernels/clusters/cluster_problem.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <map>
#include <tuple>
#include <utility>

#include "kernels/bodies/index.hpp"

namespace talus {

namespace {

using Place = ClusterProblem::Place;

/// Per part and unknown: where the body counts.
std::vector<std::vector<Place>> places_of(const BodyParts& parts) {
  std::vector<std::vector<Place>> places(parts.size());
  PartField name = parts.field();
  parts.each([&](std::size_t p) {
    for (std::size_t b = 0; b < parts[p].bodies.size(); ++b) {
      const Place own{parts[p].subdomain, static_cast<std::int32_t>(b)};
      places[p].push_back(own);
      if (parts[p].counted(b)) name[p][b].u = Vec3(own.subdomain, own.number, 0);
    }
  });
  parts.link().sum_copies(name);
  for (std::size_t p = 0; p < parts.size(); ++p)
    for (const std::int32_t b : parts[p].shared) {
      const Vec3& u = name[p][at(b)].u;
      places[p][at(b)] = {static_cast<std::int32_t>(u[0]), static_cast<std::int32_t>(u[1])};
    }
  return places;
}

/// A contact that has yet to find its bodies in a cluster's problem.
struct Joint {
  Place place;
  ContactEquation equation;  ///< first and second are not set
  Place first, second;
  Vec3 impulse;
  RollingPart rolling = {};
  Levers levers = {};  ///< of blocks, where the equation points to none
  bool block = false;
};

/// What clusters are put together from.
struct Pieces {
  std::vector<std::pair<Place, BodyUnknown>> bodies;
  std::vector<Joint> joints;
};

void add_body(Pieces& to, const BodyUnknown& body, Place place) {
  to.bodies.emplace_back(place, body);
}

RollingPart rolling_of(const BodyProblem& part, std::size_t k) {
  return part.rolling.empty() ? RollingPart{} : part.rolling[k];
}

/// Numbers of a body and of a contact as they travel: enough for a direct solve.
constexpr std::size_t body_width = 23, contact_width = 50;

void write(std::vector<double>& to, const Vec3& v) {
  to.insert(to.end(), v.begin(), v.end());
}
void write(std::vector<double>& to, const Mat3& m) {
  to.insert(to.end(), m.data(), m.data() + 9);
}
void write(std::vector<double>& to, Place place) {
  to.insert(to.end(), {static_cast<double>(place.subdomain), static_cast<double>(place.number)});
}

void write_body(std::vector<double>& to, std::int32_t cluster, const BodyUnknown& body, Place place) {
  to.push_back(cluster);
  write(to, place);
  to.insert(to.end(), {body.mass, body.spin_mass, body.radius, body.wall ? 1.0 : 0.0, body.cell ? 1.0 : 0.0});
  write(to, body.x);
  write(to, body.axis);
  write(to, body.shears);
  write(to, body.free.u);
  write(to, body.free.w);
}

/// `places`: of the contact, of its first and of its second body.
void write_contact(std::vector<double>& to, std::int32_t cluster, const ContactEquation& c,
                   const std::array<Place, 3>& places, const Vec3& impulse, const RollingPart& rolling) {
  to.push_back(cluster);
  for (const Place& place : places) write(to, place);
  to.insert(to.end(), {c.mu, c.pull, c.drive, static_cast<double>(c.wall), static_cast<double>(c.cell),
                       c.levers == nullptr ? 0.0 : 1.0});
  write(to, c.normal);
  write(to, c.branch);
  write(to, c.offset);
  write(to, impulse);
  to.push_back(rolling.arm);
  write(to, rolling.spin);
  write(to, rolling.moment);
  if (c.levers == nullptr) return;
  write(to, c.levers->first);
  write(to, c.levers->second);
}

/// Reads numbers off a row.
class Reader {
 public:
  explicit Reader(std::span<const double> row) : row_(row) {}
  double number() { return row_[next_++]; }
  std::int32_t integer() { return static_cast<std::int32_t>(number()); }
  Place place() {
    const std::int32_t subdomain = integer();
    return {subdomain, integer()};
  }
  Vec3 vector() {
    next_ += 3;
    return Eigen::Map<const Vec3>(&row_[next_ - 3]);
  }
  Mat3 matrix() {
    next_ += 9;
    return Eigen::Map<const Mat3>(&row_[next_ - 9]);
  }

 private:
  std::span<const double> row_;
  std::size_t next_ = 0;
};

void read_body(std::span<const double> row, std::vector<Pieces>& spanning) {
  Reader from(row);
  Pieces& to = spanning[at(from.integer())];
  const Place place = from.place();
  BodyUnknown body;
  body.mass = from.number();
  body.spin_mass = from.number();
  body.radius = from.number();
  body.wall = from.number() != 0;
  body.cell = from.number() != 0;
  body.x = from.vector();
  body.axis = from.vector();
  body.shears = from.vector();
  body.free.u = from.vector();
  body.free.w = from.vector();
  add_body(to, body, place);
}

void read_contact(std::span<const double> row, std::vector<Pieces>& spanning) {
  Reader from(row);
  Pieces& to = spanning[at(from.integer())];
  Joint joint;
  joint.place = from.place();
  joint.first = from.place();
  joint.second = from.place();
  joint.equation.mu = from.number();
  joint.equation.pull = from.number();
  joint.equation.drive = from.number();
  joint.equation.wall = from.integer();
  joint.equation.cell = from.integer();
  joint.block = from.number() != 0;
  joint.equation.normal = from.vector();
  joint.equation.branch = from.vector();
  joint.equation.offset = from.vector();
  joint.impulse = from.vector();
  joint.rolling.arm = from.number();
  joint.rolling.spin = from.vector();
  joint.rolling.moment = from.vector();
  if (joint.block) joint.levers = {from.matrix(), from.matrix()};
  to.joints.push_back(std::move(joint));
}

/// The pieces of the clusters that span parts, from all of them.
std::vector<Pieces> pieces_of_spanning(const BodyParts& parts, const Clusters& clusters,
                                       const std::vector<std::vector<Place>>& places) {
  std::vector<std::vector<double>> bodies(parts.size()), contacts(parts.size());
  parts.each([&](std::size_t p) {
    const auto spanning = [&](std::int32_t body) {
      const std::int32_t cluster = clusters.of_body[p][at(body)];
      return cluster < 0 ? -1 : clusters.spanning[p][at(cluster)];
    };
    for (std::size_t b = 0; b < parts[p].bodies.size(); ++b)
      if (const std::int32_t number = spanning(static_cast<std::int32_t>(b));
          number >= 0 && parts[p].counted(b))
        write_body(bodies[p], number, parts[p].bodies[b], places[p][b]);
    for (std::size_t k = 0; k < parts[p].contacts.size(); ++k) {
      const ContactEquation& c = parts[p].contacts[k];
      const std::int32_t number = spanning(c.first);
      if (number < 0) continue;
      const Place second = c.second < 0 ? Place{-1, -1} : places[p][at(c.second)];
      const Place own{parts[p].subdomain, static_cast<std::int32_t>(k)};
      write_contact(contacts[p], number, c, {own, places[p][at(c.first)], second}, parts[p].impulse[k],
                    rolling_of(parts[p], k));
      contacts[p].resize((contacts[p].size() + contact_width - 1) / contact_width * contact_width, 0.0);
    }
  });
  std::vector<Pieces> spanning(at(clusters.several));
  const std::vector<double> all_bodies = gather_padded(parts.link(), bodies, -1);
  for (std::size_t k = 0; k + body_width <= all_bodies.size(); k += body_width)
    if (all_bodies[k] >= 0) read_body(std::span(all_bodies).subspan(k, body_width), spanning);
  const std::vector<double> all_contacts = gather_padded(parts.link(), contacts, -1);
  for (std::size_t k = 0; k + contact_width <= all_contacts.size(); k += contact_width)
    if (all_contacts[k] >= 0) read_contact(std::span(all_contacts).subspan(k, contact_width), spanning);
  return spanning;
}

/// The pieces of the clusters that lie in one part alone.
std::vector<Pieces> pieces_of_part(const BodyParts& parts, const Clusters& clusters, std::size_t p,
                                   const std::vector<std::vector<Place>>& places) {
  std::vector<Pieces> pieces(at(clusters.count[p]));
  const auto own = [&](std::int32_t cluster) {
    return cluster >= 0 && clusters.spanning[p][at(cluster)] < 0 ? &pieces[at(cluster)] : nullptr;
  };
  for (std::size_t k = 0; k < parts[p].contacts.size(); ++k) {
    const ContactEquation& c = parts[p].contacts[k];
    if (Pieces* to = own(clusters.of_contact(p, c)); to != nullptr)
      to->joints.push_back({{parts[p].subdomain, static_cast<std::int32_t>(k)},
                            c,
                            places[p][at(c.first)],
                            c.second < 0 ? Place{-1, -1} : places[p][at(c.second)],
                            parts[p].impulse[k],
                            rolling_of(parts[p], k)});
  }
  for (std::size_t b = 0; b < parts[p].bodies.size(); ++b)
    if (Pieces* to = own(clusters.of_body[p][b]); to != nullptr && !to->joints.empty())
      add_body(*to, parts[p].bodies[b], places[p][b]);
  return pieces;
}

ClusterProblem put_together(Pieces pieces) {
  ClusterProblem made;
  // Walls stand behind grains, and a cell behind these (body_problem.hpp).
  std::sort(pieces.bodies.begin(), pieces.bodies.end(), [](const auto& a, const auto& b) {
    return std::tuple(a.second.cell, a.second.wall, a.first) <
           std::tuple(b.second.cell, b.second.wall, b.first);
  });
  std::sort(pieces.joints.begin(), pieces.joints.end(),
            [](const Joint& a, const Joint& b) { return a.place < b.place; });
  std::map<Place, std::int32_t> unknown;
  for (const auto& [place, body] : pieces.bodies) {
    unknown.emplace(place, static_cast<std::int32_t>(made.bodies.size()));
    made.bodies.push_back(place);
    made.problem.bodies.push_back(body);
    if (!body.wall && !body.cell) ++made.problem.grains;
  }
  made.levers.reserve(pieces.joints.size());
  const bool rolling = std::ranges::any_of(pieces.joints, [](const Joint& of) { return of.rolling.arm > 0; });
  for (const Joint& joint : pieces.joints) {
    ContactEquation c = joint.equation;
    c.first = unknown.at(joint.first);
    c.second = joint.second.subdomain < 0 ? -1 : unknown.at(joint.second);
    if (c.cell >= 0) c.cell = static_cast<std::int32_t>(made.problem.bodies.size()) - 1;
    c.place = -1;
    if (joint.block) c.levers = &made.levers.emplace_back(joint.levers);
    made.problem.contacts.push_back(c);
    made.problem.impulse.push_back(joint.impulse);
    if (rolling) made.problem.rolling.push_back(joint.rolling);
    made.contacts.push_back(joint.place);
  }
  return made;
}

}  // namespace

std::vector<ClusterProblem> cluster_problems(const BodyParts& parts, const Clusters& clusters) {
  const std::vector<std::vector<Place>> places = places_of(parts);
  std::vector<Pieces> pieces;
  std::vector<Pieces> spanning;
  if (clusters.several > 0) spanning = pieces_of_spanning(parts, clusters, places);
  std::vector<char> here(spanning.size(), 0);
  for (std::size_t p = 0; p < parts.size(); ++p) {
    for (const std::int32_t number : clusters.spanning[p])
      if (number >= 0) here[at(number)] = 1;
    std::vector<Pieces> own = pieces_of_part(parts, clusters, p, places);
    std::move(own.begin(), own.end(), std::back_inserter(pieces));
  }
  for (std::size_t k = 0; k < spanning.size(); ++k)
    if (here[k] != 0) pieces.push_back(std::move(spanning[k]));
  std::vector<ClusterProblem> made;
  for (Pieces& of : pieces)
    if (!of.joints.empty() && !of.bodies.empty()) made.push_back(put_together(std::move(of)));
  std::sort(made.begin(), made.end(), [](const ClusterProblem& a, const ClusterProblem& b) {
    return a.bodies.front() < b.bodies.front();
  });
  return made;
}

}  // namespace talus
