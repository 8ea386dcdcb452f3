#include "io/scene/detail/shape_keys.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "io/files/error.hpp"
#include "io/files/stl.hpp"

namespace talus::io::detail {

namespace {

using Kind = ShapeParameter::Kind;

const ShapeParameter* find(const ShapeEntry& shape, const std::string& name) {
  for (const ShapeParameter& parameter : shape.parameters)
    if (parameter.name == name) return &parameter;
  return nullptr;
}

bool has(const Wall& wall, const std::string& name) {
  const ShapeEntry* shape = wall_shape(wall.shape.name);
  return shape != nullptr && find(*shape, name) != nullptr;
}

/// Keeps a value of type T as numbers, and gives it back.
template <class T, class In, class Out>
Key<Wall> numbers(const ShapeParameter& parameter, Range range, In in, Out out) {
  const std::string name = parameter.name;
  return bound<T, Wall>(
      parameter.name, parameter.unit, range, parameter.meaning,
      [name, in](Wall& wall, const T& value) { wall.shape.values.number[name] = in(value); },
      [name, out](const Wall& wall) {
        const auto& held = wall.shape.values.number;
        return held.contains(name) ? Value{out(held.at(name))} : Value{};
      });
}

Key<Wall> key_of(const ShapeParameter& parameter) {
  using Numbers = std::vector<double>;
  switch (parameter.kind) {
    case Kind::vector:
      return numbers<Vec3>(
          parameter, any, [](const Vec3& v) { return Numbers(v.begin(), v.end()); },
          [](const Numbers& n) { return n; });
    case Kind::truth:
      return numbers<bool>(
                 parameter, any, [](bool yes) { return Numbers{yes ? 1.0 : 0.0}; },
                 [](const Numbers& n) { return n[0] != 0; })
          .or_else("`false`");
    case Kind::file:
      return bound<std::string, Wall>(
          parameter.name, "", any, parameter.meaning,
          [](Wall& wall, const std::string& file) { wall.shape.values.file = file; },
          [](const Wall& wall) -> Value { return wall.shape.values.file; });
    case Kind::length:
    case Kind::extent:
      break;
  }
  return numbers<double>(
      parameter, parameter.kind == Kind::length ? positive : not_negative,
      [](double value) { return Numbers{value}; }, [](const Numbers& n) { return n[0]; });
}

}  // namespace

std::vector<Key<Wall>> shape_keys() {
  std::vector<std::string> names = {"plane"};
  std::string sentences = "`plane`: everything behind it is solid";
  for (const ShapeEntry* shape : wall_shapes()) {
    names.emplace_back(shape->name);
    sentences += fmt::format("; `{}`: {}", shape->name, shape->sentence);
  }
  auto shape = bound<std::string, Wall>(
      "shape", "", any, "",
      [](Wall& wall, const std::string& name) {
        wall.shape.name = name;
        if (name != "plane") wall.normal.setZero();
      },
      [](const Wall& wall) -> Value { return wall.shape.name; });
  shape.meaning =
      "What the wall looks like. " + sentences + ". Walls that are no planes are moved by `motion` alone.";
  shape.choices = names;
  std::vector<Key<Wall>> keys = {std::move(shape)};
  for (const ShapeEntry* entry : wall_shapes())
    for (const ShapeParameter& parameter : entry->parameters) {
      const std::string name = parameter.name;
      if (std::ranges::any_of(keys, [&](const Key<Wall>& key) { return key.name == name; })) continue;
      std::string users;
      for (const ShapeEntry* other : wall_shapes())
        if (find(*other, name) != nullptr) users += (users.empty() ? "" : " or ") + std::string(other->name);
      Key<Wall> key =
          key_of(parameter).only("shape = " + users, [name](const Wall& wall) { return has(wall, name); });
      key.required = parameter.kind != Kind::truth;
      keys.push_back(std::move(key));
    }
  return keys;
}

void keep_for_planes(std::vector<Key<Wall>>& keys) {
  for (Key<Wall>& key : keys) {
    key.applies = [also = std::move(key.applies)](const Wall& wall) {
      return wall.shape.name == "plane" && (!also || also(wall));
    };
    key.when += key.when.empty() ? "shape = plane" : ", shape = plane";
  }
}

void read_surface(Wall& wall) {
  if (wall.shape.name == "plane") return;
  const std::string& file = wall.shape.values.file;
  if (!file.empty()) wall.shape.values.triangles = read_stl(file);
  try {
    make_surface(wall.shape);
  } catch (const std::invalid_argument& error) {
    if (file.empty()) throw;
    throw FileError(file, error.what());
  }
}

}  // namespace talus::io::detail
