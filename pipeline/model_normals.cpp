#include "pipeline/model_normals.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <nanoflann.hpp>
#include <queue>
#include <vector>

#include "pipeline/neighbours/symmetric3.h"

namespace grapnel {
namespace {

constexpr std::size_t kNeighbours = 24;
// A denser cloud is averaged down to this many points first: several readings of one place lie one
// behind the other, and their neighbours say nothing about the surface.
constexpr std::size_t kMaxPoints = 12000;

struct Points {
  const Model* model;
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return model->size(); }
  [[nodiscard]] float kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return axis == 0 ? model->x[i] : axis == 1 ? model->y[i] : model->z[i];
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};
using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Points>,
                                                 Points, 3, std::uint32_t>;

struct Nearest {
  std::array<std::uint32_t, kNeighbours> index{};
  std::array<float, kNeighbours> square{};
  std::size_t count = 0;
};

Nearest nearest(const Tree& tree, const Model& model, std::size_t i, std::size_t count) {
  Nearest found;
  const std::array<float, 3> place = {model.x[i], model.y[i], model.z[i]};
  found.count = tree.knnSearch(place.data(), count, found.index.data(), found.square.data());
  return found;
}

Vec3f plane_normal(const Model& model, const Nearest& around) {
  Vec3d mean = Vec3d::Zero();
  for (std::size_t k = 0; k < around.count; ++k) {
    const std::uint32_t j = around.index[k];
    mean += Vec3d(model.x[j], model.y[j], model.z[j]);
  }
  mean /= static_cast<double>(around.count);
  Symmetric3 scatter;
  for (std::size_t k = 0; k < around.count; ++k) {
    const std::uint32_t j = around.index[k];
    const Vec3d d = Vec3d(model.x[j], model.y[j], model.z[j]) - mean;
    scatter.add(d.x(), d.y(), d.z());
  }
  return eigen_symmetric3(scatter).vectors.col(0).cast<float>();
}

struct Step {
  float cost = 0.0F;  // 1 - |cosine| between the two normals
  std::uint32_t from = 0;
  std::uint32_t to = 0;
  bool operator>(const Step& other) const {
    if (cost != other.cost) return cost > other.cost;
    return to != other.to ? to > other.to : from > other.from;
  }
};

/// Walks one connected piece from `start`, flattest steps first, and turns it outward as a whole.
void orient_piece(Model& model, const std::vector<Nearest>& around, std::uint32_t start,
                  const Vec3f& centre, std::vector<std::uint8_t>& done) {
  const auto normal = [&](std::uint32_t i) { return Vec3f(model.nx[i], model.ny[i], model.nz[i]); };
  const auto flip = [&](std::uint32_t i) {
    model.nx[i] = -model.nx[i];
    model.ny[i] = -model.ny[i];
    model.nz[i] = -model.nz[i];
  };
  std::priority_queue<Step, std::vector<Step>, std::greater<>> steps;
  std::vector<std::uint32_t> piece;
  const auto visit = [&](std::uint32_t i) {
    done[i] = 1;
    piece.push_back(i);
    for (std::size_t k = 0; k < std::min<std::size_t>(around[i].count, 9); ++k) {
      const std::uint32_t j = around[i].index[k];
      if (done[j] == 0) steps.push({1.0F - std::fabs(normal(i).dot(normal(j))), i, j});
    }
  };
  visit(start);
  while (!steps.empty()) {
    const Step step = steps.top();
    steps.pop();
    if (done[step.to] != 0) continue;
    if (normal(step.from).dot(normal(step.to)) < 0.0F) flip(step.to);
    visit(step.to);
  }
  double outward = 0.0;
  for (const std::uint32_t i : piece) {
    const Vec3f arm = Vec3f(model.x[i], model.y[i], model.z[i]) - centre;
    outward += static_cast<double>(arm.dot(normal(i)));
  }
  if (outward < 0.0) std::for_each(piece.begin(), piece.end(), flip);
}

}  // namespace

double mean_nearest_distance_m(const Model& model) {
  const Points points{&model};
  const Tree tree(3, points);
  const std::size_t step = std::max<std::size_t>(1, model.size() / 2000);
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < model.size(); i += step) {
    const Nearest found = nearest(tree, model, i, 2);
    if (found.count < 2) continue;
    sum += std::sqrt(static_cast<double>(found.square[1]));
    ++count;
  }
  return count == 0 ? 0.0 : sum / static_cast<double>(count);
}

namespace {

/// Mean points of cubic cells, at most kMaxPoints of them.
Model averaged(const Model& model) {
  struct Entry {
    std::uint64_t cell = 0;
    std::uint32_t point = 0;
  };
  std::vector<Entry> entries(model.size());
  const float low_x = *std::min_element(model.x.begin(), model.x.end());
  const float low_y = *std::min_element(model.y.begin(), model.y.end());
  const float low_z = *std::min_element(model.z.begin(), model.z.end());
  double edge_m = model.diameter_m / 1000.0;
  for (;;) {
    for (std::uint32_t i = 0; i < model.size(); ++i) {
      const auto cell = [&](float value, float low) {
        return static_cast<std::uint64_t>(static_cast<double>(value - low) / edge_m);
      };
      entries[i].point = i;
      entries[i].cell = (cell(model.z[i], low_z) << 40U) + (cell(model.y[i], low_y) << 20U) +
                        cell(model.x[i], low_x);
    }
    std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
      return a.cell != b.cell ? a.cell < b.cell : a.point < b.point;
    });
    Model mean;
    for (std::size_t begin = 0, end = 0; begin < entries.size(); begin = end) {
      Vec3d sum = Vec3d::Zero();
      for (; end < entries.size() && entries[end].cell == entries[begin].cell; ++end) {
        const std::uint32_t i = entries[end].point;
        sum += Vec3d(model.x[i], model.y[i], model.z[i]);
      }
      sum /= static_cast<double>(end - begin);
      mean.x.push_back(static_cast<float>(sum.x()));
      mean.y.push_back(static_cast<float>(sum.y()));
      mean.z.push_back(static_cast<float>(sum.z()));
    }
    mean.nx.resize(mean.size());
    mean.ny.resize(mean.size());
    mean.nz.resize(mean.size());
    if (mean.size() <= kMaxPoints) return mean;
    edge_m *= 1.1;
  }
}

void estimate_directly(Model& model) {
  const Points points{&model};
  const Tree tree(3, points);
  std::vector<Nearest> around(model.size());
  Vec3d centre = Vec3d::Zero();
  for (std::size_t i = 0; i < model.size(); ++i) {
    around[i] = nearest(tree, model, i, kNeighbours);
    const Vec3f normal = plane_normal(model, around[i]);
    model.nx[i] = normal.x();
    model.ny[i] = normal.y();
    model.nz[i] = normal.z();
    centre += Vec3d(model.x[i], model.y[i], model.z[i]);
  }
  centre /= static_cast<double>(model.size());
  std::vector<std::uint8_t> done(model.size(), 0);
  for (std::uint32_t i = 0; i < model.size(); ++i) {
    if (done[i] == 0) orient_piece(model, around, i, centre.cast<float>(), done);
  }
}

}  // namespace

void estimate_model_normals(Model& model) {
  if (model.size() <= kMaxPoints) {
    estimate_directly(model);
    return;
  }
  Model mean = averaged(model);
  estimate_directly(mean);
  const Points points{&mean};
  const Tree tree(3, points);
  for (std::size_t i = 0; i < model.size(); ++i) {
    const std::array<float, 3> place = {model.x[i], model.y[i], model.z[i]};
    std::uint32_t found = 0;
    float square = 0.0F;
    tree.knnSearch(place.data(), 1, &found, &square);
    model.nx[i] = mean.nx[found];
    model.ny[i] = mean.ny[found];
    model.nz[i] = mean.nz[found];
  }
}

}  // namespace grapnel
