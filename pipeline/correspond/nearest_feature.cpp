#include "pipeline/correspond/nearest_feature.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <string_view>

namespace grapnel {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
/// Added to every bin of a normalised row: far below one vote, far above nothing.
constexpr double kFloor = 1e-6;

bool all_zero(std::span<const float> row) noexcept {
  return std::all_of(row.begin(), row.end(), [](float value) { return value == 0.0F; });
}

}  // namespace

FieldTable nearest_feature_fields() noexcept {
  using P = NearestFeatureParams;
  static constexpr std::array<std::string_view, 3> kNormalise = {"auto", "no", "yes"};
  static constexpr std::array<std::string_view, 2> kEngines = {"fast", "reference"};
  static constexpr std::array kFields = {
      choice_field<&P::metric>("metric", kMetricNames, "distance between rows"),
      number_field<&P::top>("top", "", 1, NearestFeature::kMaxTop,
                            "targets kept for each source keypoint"),
      bool_field<&P::mutual>("mutual", "keep only pairs that choose each other"),
      number_field<&P::max_ratio>("max_ratio", "", 0.1, 1.0,
                                  "nearest over second nearest distance, at most"),
      number_field<&P::max_distance>("max_distance", "", 0.0, 1e6,
                                     "distance of a pair at the most; 0 = any"),
      choice_field<&P::normalise>(
          "normalise", kNormalise,
          "rows scaled to a sum of 1; auto: for jm, b, cs, div, kl, hik (PCL: no)"),
      number_field<&P::source_factor>("source_factor", "", -1e6, 1e6, "of the metrics pf and k"),
      number_field<&P::target_factor>("target_factor", "", -1e6, 1e6, "of the metrics pf and k"),
      choice_field<&P::engine>("engine", kEngines, "fast, or plain loops in double"),
  };
  return kFields;
}

void NearestFeature::reserve(Arena& arena, const Limits& limits) {
  const std::size_t length = plan_.length(limits.descriptor_dimension);
  const std::size_t padded = (limits.max_keypoints + kernels::kRowsInBlock - 1) /
                             kernels::kRowsInBlock * kernels::kRowsInBlock;
  best_ = arena.take<kernels::BestRow>(limits.max_keypoints *
                                       (std::max<std::size_t>(params_.top, 1) + 1));
  best_of_target_ = arena.take<kernels::BestRow>(limits.max_keypoints);
  queries_ = arena.take<float>(limits.max_keypoints * length);
  row_ = arena.take<float>(length);
  order_ = arena.take<std::uint32_t>(length);
  blocks_ = arena.take<float>(padded * length);
  bias_ = arena.take<float>(padded);
  for (std::span<double>* row : {&left_, &right_}) {
    *row = arena.take<double>(limits.descriptor_dimension);
  }
}

std::span<const double> NearestFeature::prepare(std::span<const float> row,
                                                std::span<double> out) const noexcept {
  std::copy(row.begin(), row.end(), out.begin());
  const bool normalise =
      params_.normalise == Normalise::Yes ||
      (params_.normalise == Normalise::Auto && compares_distributions(params_.metric));
  if (!normalise) return out.first(row.size());
  double sum = 0.0;
  for (const double value : out.first(row.size())) sum += value;
  if (sum > 0.0) {
    const double scale = 1.0 / (1.0 + kFloor * static_cast<double>(row.size()));
    for (std::size_t i = 0; i < row.size(); ++i) out[i] = (out[i] / sum + kFloor) * scale;
  }
  return out.first(row.size());
}

void NearestFeature::fill_blocks(const FeatureMatrix& rows, MetricSide side) noexcept {
  const std::size_t length = plan_.length(rows.dimension);
  const std::size_t padded =
      (rows.rows + kernels::kRowsInBlock - 1) / kernels::kRowsInBlock * kernels::kRowsInBlock;
  for (std::size_t row = 0; row < padded; ++row) {
    float* to = blocks_.data() + row / kernels::kRowsInBlock * kernels::kRowsInBlock * length +
                row % kernels::kRowsInBlock;
    const bool findable = row < rows.rows && !all_zero(rows.row(row));
    bias_[row] = findable ? 0.0F : kInfinity;
    const std::span<float> row_of = row_.first(length);
    std::ranges::fill(row_of, 0.0F);
    if (findable) {
      transform_row(params_.metric, {params_.source_factor, params_.target_factor}, side,
                    prepare(rows.row(row), left_), row_of);
    }
    for (std::size_t i = 0; i < length; ++i) to[i * kernels::kRowsInBlock] = row_of[order_[i]];
  }
}

void NearestFeature::order_elements(const FeatureMatrix& rows, std::size_t length) noexcept {
  const std::span<std::uint32_t> order = order_.first(length);
  std::iota(order.begin(), order.end(), 0U);
  // Elements of several parts are no elements of the row.
  if (plan_.parts > 1 || plan_.extra > 0) return;
  const std::span<double> mean = left_.first(length);
  const std::span<double> spread = right_.first(length);
  std::ranges::fill(mean, 0.0);
  std::ranges::fill(spread, 0.0);
  for (std::size_t r = 0; r < rows.rows; ++r) {
    const std::span<const float> row = rows.row(r);
    for (std::size_t i = 0; i < length; ++i) mean[i] += static_cast<double>(row[i]);
  }
  for (double& value : mean) value /= static_cast<double>(rows.rows);
  for (std::size_t r = 0; r < rows.rows; ++r) {
    const std::span<const float> row = rows.row(r);
    for (std::size_t i = 0; i < length; ++i) {
      const double off = static_cast<double>(row[i]) - mean[i];
      spread[i] += off * off;
    }
  }
  // What is no number has its place too.
  for (double& value : spread) value = value > 0.0 ? value : 0.0;
  std::ranges::sort(order, [&](std::uint32_t a, std::uint32_t b) {
    return spread[a] > spread[b] || (spread[a] == spread[b] && a < b);
  });
}

void NearestFeature::search_fast(const FeatureMatrix& queries, const FeatureMatrix& rows,
                                 MetricSide queries_are, std::size_t kept,
                                 std::span<kernels::BestRow> best) noexcept {
  const std::size_t length = plan_.length(rows.dimension);
  order_elements(rows, length);
  fill_blocks(rows, queries_are == MetricSide::Source ? MetricSide::Target : MetricSide::Source);
  const kernels::RowBlocks blocks{blocks_.data(), bias_.data(),
                                  (rows.rows + kernels::kRowsInBlock - 1) / kernels::kRowsInBlock,
                                  length};
  std::array<const float*, kernels::kQueriesAtOnce> group{};
  std::array<kernels::BestRow*, kernels::kQueriesAtOnce> lists{};
  std::size_t count = 0;
  const auto flush = [&] {
    if (count > 0) {
      kernels::best_rows(plan_.score, blocks, group.data(), count, kept, lists.data());
    }
    count = 0;
  };
  for (std::size_t q = 0; q < queries.rows; ++q) {
    if (all_zero(queries.row(q))) continue;
    const std::span<float> row = queries_.subspan(q * length, length);
    transform_row(params_.metric, {params_.source_factor, params_.target_factor}, queries_are,
                  prepare(queries.row(q), left_), row_.first(length));
    for (std::size_t i = 0; i < length; ++i) row[i] = row_[order_[i]];
    group[count] = row.data();
    lists[count] = best.data() + q * kept;
    if (++count == kernels::kQueriesAtOnce) flush();
  }
  flush();
}

void NearestFeature::search_plain(const FeatureMatrix& queries, const FeatureMatrix& rows,
                                  MetricSide queries_are, std::size_t kept,
                                  std::span<kernels::BestRow> best) noexcept {
  const bool forward = queries_are == MetricSide::Source;
  for (std::size_t q = 0; q < queries.rows; ++q) {
    if (all_zero(queries.row(q))) continue;
    kernels::BestRow* list = best.data() + q * kept;
    for (std::size_t r = 0; r < rows.rows; ++r) {
      if (all_zero(rows.row(r))) continue;
      const auto score = static_cast<float>(forward ? distance(queries, q, rows, r)
                                                    : distance(rows, r, queries, q));
      if (!(score < list[kept - 1].score)) continue;
      std::size_t place = kept - 1;
      for (; place > 0 && score < list[place - 1].score; --place) list[place] = list[place - 1];
      list[place] = {score, static_cast<std::int32_t>(r)};
    }
  }
}

void NearestFeature::search(const FeatureMatrix& queries, const FeatureMatrix& rows,
                            MetricSide queries_are, std::size_t kept,
                            std::span<kernels::BestRow> best) noexcept {
  std::fill_n(best.begin(), queries.rows * kept, kernels::BestRow{kInfinity, -1});
  if (params_.engine == Engine::Fast) {
    search_fast(queries, rows, queries_are, kept, best);
  } else {
    search_plain(queries, rows, queries_are, kept, best);
  }
}

double NearestFeature::distance(const FeatureMatrix& source, std::size_t s,
                                const FeatureMatrix& target, std::size_t t) noexcept {
  return metric_distance(params_.metric, prepare(source.row(s), left_),
                         prepare(target.row(t), right_),
                         {params_.source_factor, params_.target_factor});
}

void NearestFeature::keep(const FeatureMatrix& source, std::size_t s, const FeatureMatrix& target,
                          Correspondences& correspondences) noexcept {
  const std::size_t kept = std::max<std::size_t>(params_.top, 1) + 1;
  const kernels::BestRow* best = best_.data() + s * kept;
  for (std::size_t k = 0; k + 1 < kept && best[k].row >= 0; ++k) {
    const auto t = static_cast<std::size_t>(best[k].row);
    const double near = distance(source, s, target, t);
    if (k == 0 && params_.max_ratio < 1.0 && best[1].row >= 0 &&
        near > params_.max_ratio *
                   distance(source, s, target, static_cast<std::size_t>(best[1].row))) {
      return;
    }
    if (params_.max_distance > 0.0 && near > params_.max_distance) return;
    if (params_.mutual && best_of_target_[t].row != static_cast<std::int32_t>(s)) continue;
    correspondences.push_back(
        {static_cast<std::int32_t>(s), best[k].row, static_cast<float>(near)});
  }
}

Status NearestFeature::match(const FeatureMatrix& source, const FeatureMatrix& target,
                             Correspondences& correspondences) noexcept {
  correspondences.clear();
  if (source.dimension != target.dimension) {
    return Error{Code::BadParameter, Stage::Match, static_cast<std::int32_t>(target.dimension)};
  }
  const std::size_t rows = std::max(source.rows, target.rows);
  const std::size_t length = plan_.length(source.dimension);
  if (rows > best_of_target_.size() || source.dimension > left_.size() ||
      rows * length > queries_.size()) {
    return Error{Code::CapacityExceeded, Stage::Match, static_cast<std::int32_t>(rows)};
  }
  if (source.rows == 0 || target.rows == 0) return {};
  const std::size_t kept = std::max<std::size_t>(params_.top, 1) + 1;
  search(source, target, MetricSide::Source, kept, best_);
  if (params_.mutual) search(target, source, MetricSide::Target, 1, best_of_target_);
  for (std::size_t s = 0; s < source.rows; ++s) keep(source, s, target, correspondences);
  return {};
}

}  // namespace grapnel
