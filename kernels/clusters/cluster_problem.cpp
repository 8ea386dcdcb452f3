#include "kernels/clusters/cluster_problem.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <tuple>
#include <type_traits>
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
  Place place = {};
  ContactEquation equation;  ///< its first and second are numbers of a part, and mean nothing here
  Place first = {}, second = {};
  Vec3 impulse = Vec3::Zero();
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

/// What of a body and of a contact travels between parts, in rows of numbers: enough for a direct solve. One
/// list serves to write, to read and to count them, so that none is written and not read.
template <class Row>
void each_number(Row&& row, std::int32_t& cluster, Place& place, BodyUnknown& body) {
  row(cluster, place.subdomain, place.number, body.mass, body.spin_mass, body.radius, body.kind, body.x,
      body.axis, body.shears, body.free.u, body.free.w);
}
template <class Row>
void each_number(Row&& row, std::int32_t& cluster, Joint& joint) {
  row(cluster);
  for (Place* place : {&joint.place, &joint.first, &joint.second}) row(place->subdomain, place->number);
  ContactEquation& c = joint.equation;
  row(c.mu, c.pull, c.drive, c.wall, c.cell, c.normal, c.branch, c.offset, joint.impulse);
  row(joint.rolling.arm, joint.rolling.spin, joint.rolling.moment);
  row(joint.block, joint.levers.first, joint.levers.second);
}

class RowWriter {
 public:
  explicit RowWriter(std::vector<double>& to) : to_(to) {}
  void operator()(const auto&... values) { (put(values), ...); }

 private:
  template <class T>
  void put(const T& value) {
    if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>)
      to_.push_back(static_cast<double>(value));
    else
      to_.insert(to_.end(), value.data(), value.data() + value.size());
  }
  std::vector<double>& to_;
};

class RowReader {
 public:
  explicit RowReader(std::span<const double> row) : row_(row) {}
  void operator()(auto&... values) { (take(values), ...); }

 private:
  template <class T>
  void take(T& value) {
    if constexpr (std::is_same_v<T, bool>)
      value = row_[next_++] != 0;
    else if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>)
      value = static_cast<T>(row_[next_++]);
    else
      for (double& number : value.reshaped()) number = row_[next_++];
  }
  std::span<const double> row_;
  std::size_t next_ = 0;
};

void write_body(std::vector<double>& to, std::int32_t cluster, Place place, BodyUnknown body) {
  each_number(RowWriter(to), cluster, place, body);
}

void write_joint(std::vector<double>& to, std::int32_t cluster, Joint joint) {
  each_number(RowWriter(to), cluster, joint);
}

void read_body(std::span<const double> row, std::vector<Pieces>& spanning) {
  std::int32_t cluster = 0;
  Place place;
  BodyUnknown body;
  each_number(RowReader(row), cluster, place, body);
  add_body(spanning[at(cluster)], body, place);
}

void read_joint(std::span<const double> row, std::vector<Pieces>& spanning) {
  std::int32_t cluster = 0;
  Joint joint;
  each_number(RowReader(row), cluster, joint);
  spanning[at(cluster)].joints.push_back(std::move(joint));
}

/// Reads the rows of all parts; a row of a filler is none.
void read_rows(const PartLink& link, const std::vector<std::vector<double>>& rows, std::size_t width,
               void (&read)(std::span<const double>, std::vector<Pieces>&), std::vector<Pieces>& spanning) {
  constexpr double filler = -1;
  const std::vector<double> all = gather_padded(link, rows, filler);
  for (std::size_t k = 0; k + width <= all.size(); k += width)
    if (all[k] != filler) read(std::span(all).subspan(k, width), spanning);
}

/// Contact k of a part, whose second body may be missing.
Joint joint_of(const BodyProblem& part, std::size_t k, const std::vector<Place>& places) {
  const ContactEquation& c = part.contacts[k];
  return {.place = {part.subdomain, static_cast<std::int32_t>(k)},
          .equation = c,
          .first = places[at(c.first)],
          .second = c.second < 0 ? Place{-1, -1} : places[at(c.second)],
          .impulse = part.impulse[k],
          .rolling = rolling_of(part, k)};
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
        write_body(bodies[p], number, places[p][b], parts[p].bodies[b]);
    for (std::size_t k = 0; k < parts[p].contacts.size(); ++k) {
      const ContactEquation& c = parts[p].contacts[k];
      const std::int32_t number = spanning(c.first);
      if (number < 0) continue;
      Joint joint = joint_of(parts[p], k, places[p]);
      joint.block = c.levers != nullptr;
      if (joint.block) joint.levers = *c.levers;
      write_joint(contacts[p], number, std::move(joint));
    }
  });
  std::vector<Pieces> spanning(at(clusters.several));
  std::vector<double> a_body, a_joint;  // for their widths
  write_body(a_body, 0, {}, {});
  write_joint(a_joint, 0, {});
  read_rows(parts.link(), bodies, a_body.size(), read_body, spanning);
  read_rows(parts.link(), contacts, a_joint.size(), read_joint, spanning);
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
      to->joints.push_back(joint_of(parts[p], k, places[p]));
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
    return std::tuple(a.second.kind, a.first) < std::tuple(b.second.kind, b.first);
  });
  std::sort(pieces.joints.begin(), pieces.joints.end(),
            [](const Joint& a, const Joint& b) { return a.place < b.place; });
  std::map<Place, std::int32_t> unknown;
  for (const auto& [place, body] : pieces.bodies) {
    unknown.emplace(place, static_cast<std::int32_t>(made.bodies.size()));
    made.bodies.push_back(place);
    made.problem.bodies.push_back(body);
    if (body.kind == BodyKind::grain) ++made.problem.grains;
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
