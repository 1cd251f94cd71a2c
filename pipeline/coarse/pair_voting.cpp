#include "pipeline/coarse/pair_voting.h"

#include <algorithm>
#include <cmath>

#include "base/math.h"

namespace grapnel {
namespace {

// Drost 2010: a twentieth of the diameter and 12 degrees.
constexpr int kDistances = 20;
constexpr int kAngles = 15;
constexpr std::size_t kBuckets = std::size_t{kDistances} * kAngles * kAngles * kAngles;
constexpr std::size_t kTurns = 32;
// Worth of a pair's vote: this over the pairs that share its features.
constexpr std::uint32_t kWorth = 4096;
constexpr std::uint32_t kRare = 16;

/// How point `j` lies about the normal of a point with this frame, 65536 = a full turn.
std::uint16_t turn_of(const Mat3d& frame, const Surface& surface, std::size_t i,
                      std::size_t j) noexcept {
  const Vec3d way = frame * (surface.point(j) - surface.point(i)).cast<double>();
  const double share = math::atan2(way.z(), way.y()) / (2.0 * math::kPi) + 1.0;
  return static_cast<std::uint16_t>(static_cast<std::uint32_t>(share * 65536.0) & 0xffffU);
}

}  // namespace

FieldTable pair_voting_fields() noexcept {
  using P = PairVotingParams;
  static constexpr std::array kFields = {
      number_field<&P::model_points>("model_points", "", 20, 2000,
                                     "points of the source whose pairs are learned"),
      number_field<&P::references>("references", "", 1, 10000, "points of the target that vote"),
      number_field<&P::partners>("partners", "", 10, 10000,
                                 "points of the target that each is paired with"),
      number_field<&P::max_bucket>("max_bucket", "", 1, 65536,
                                   "pairs kept of those with the same features"),
      number_field<&P::peaks>("peaks", "", 1, 8, "poses proposed by a voting point"),
      number_field<&P::quick_samples>("quick_samples", "", 16, 4096, "samples of a first rating"),
  };
  return kFields;
}

PairVoting::PairVoting(const PairVotingParams& params) : params_(params) {
  for (std::size_t i = 0; i < kCosines; ++i) {
    const double cosine = (2.0 * static_cast<double>(i) + 1.0) / kCosines - 1.0;
    const int bin = static_cast<int>(math::acos(cosine) / math::kPi * kAngles);
    angle_bin_[i] = static_cast<std::uint8_t>(std::min(bin, kAngles - 1));
  }
}

void PairVoting::reserve(Arena& arena, const Limits&) {
  const std::size_t pairs = params_.model_points * params_.model_points;
  model_ = arena.take<std::uint32_t>(params_.model_points);
  bucket_ = arena.take<std::int32_t>(pairs);
  begin_ = arena.take<std::uint32_t>(kBuckets + 1);
  length_ = arena.take<std::uint32_t>(kBuckets);
  seen_ = arena.take<std::uint32_t>(kBuckets);
  entries_ = arena.take<Entry>(pairs);
  votes_ = arena.take<std::uint32_t>(params_.model_points * kTurns);
  finalists_.reserve(arena);
  learned_ = 0;
}

std::int32_t PairVoting::bucket_of(const Surface& surface, std::size_t i,
                                   std::size_t j) const noexcept {
  const Vec3f way = surface.point(j) - surface.point(i);
  const float distance_m = way.norm();
  const int distance = static_cast<int>(static_cast<double>(distance_m) / diameter_m_ * kDistances);
  // Of the nearest pairs the normals' noise is all that is left.
  if (distance < 1 || distance >= kDistances) return -1;
  const Vec3f along = way / distance_m;
  const auto bin = [&](float cosine) {
    const int index = static_cast<int>((cosine + 1.0F) * (0.5F * kCosines));
    return static_cast<int>(
        angle_bin_[static_cast<std::size_t>(std::clamp(index, 0, static_cast<int>(kCosines) - 1))]);
  };
  const Vec3f n = surface.normal(i);
  const Vec3f m = surface.normal(j);
  return ((distance * kAngles + bin(n.dot(along))) * kAngles + bin(m.dot(along))) * kAngles +
         bin(n.dot(m));
}

void PairVoting::learn(const Surface& source) noexcept {
  model_size_ = std::min(params_.model_points, source.size);
  for (std::size_t k = 0; k < model_size_; ++k) {
    model_[k] = static_cast<std::uint32_t>(k * source.size / model_size_);
  }
  std::fill(length_.begin(), length_.end(), 0U);
  for (std::size_t a = 0; a < model_size_; ++a) {
    for (std::size_t b = 0; b < model_size_; ++b) {
      const std::int32_t bucket = a == b ? -1 : bucket_of(source, model_[a], model_[b]);
      bucket_[a * model_size_ + b] = bucket;
      if (bucket >= 0) ++length_[static_cast<std::size_t>(bucket)];
    }
  }
  std::uint32_t next = 0;
  const auto most = static_cast<std::uint32_t>(params_.max_bucket);
  for (std::size_t bucket = 0; bucket < kBuckets; ++bucket) {
    begin_[bucket] = next;
    next += std::min(length_[bucket], most);
  }
  begin_[kBuckets] = next;
  // An even choice of a long bucket: the n-th pair is kept where n · kept / length steps up.
  std::fill(seen_.begin(), seen_.end(), 0U);
  for (std::size_t a = 0; a < model_size_; ++a) {
    const Mat3d frame = frame_about(source.normal(model_[a]).cast<double>()).transpose();
    for (std::size_t b = 0; b < model_size_; ++b) {
      const std::int32_t found = bucket_[a * model_size_ + b];
      if (found < 0) continue;
      const auto bucket = static_cast<std::size_t>(found);
      const std::uint64_t kept = begin_[bucket + 1] - begin_[bucket];
      const std::uint64_t place = seen_[bucket] * kept / length_[bucket];
      ++seen_[bucket];
      if (seen_[bucket] * kept / length_[bucket] == place) continue;
      entries_[begin_[bucket] + place] = {static_cast<std::uint16_t>(a),
                                          turn_of(frame, source, model_[a], model_[b])};
    }
  }
}

void PairVoting::vote(const Surface& target, std::size_t reference) noexcept {
  std::fill(votes_.begin(), votes_.end(), 0U);
  const Mat3d frame = frame_about(target.normal(reference).cast<double>()).transpose();
  const std::size_t partners = std::min(params_.partners, target.size);
  for (std::size_t k = 0; k < partners; ++k) {
    const std::size_t partner = k * target.size / partners;
    if (partner == reference || !target.has_normal(partner)) continue;
    const std::int32_t found = bucket_of(target, reference, partner);
    if (found < 0) continue;
    const auto bucket = static_cast<std::size_t>(found);
    if (begin_[bucket] == begin_[bucket + 1]) continue;
    const std::uint32_t turn = turn_of(frame, target, reference, partner);
    const std::uint32_t worth = kWorth / std::max(kRare, length_[bucket]) + 1;
    for (std::uint32_t i = begin_[bucket]; i < begin_[bucket + 1]; ++i) {
      const std::uint32_t about = (turn - entries_[i].turn) & 0xffffU;
      votes_[entries_[i].point * kTurns + about * kTurns / 65536] += worth;
    }
  }
}

void PairVoting::propose(const PairView& pair, std::size_t reference) noexcept {
  const Vec3d place = pair.target->point(reference).cast<double>();
  const Mat3d target_frame = frame_about(pair.target->normal(reference).cast<double>()).transpose();
  for (std::size_t peak = 0; peak < params_.peaks; ++peak) {
    const auto most = std::max_element(votes_.begin(), votes_.end());
    if (*most == 0) return;
    const auto cell = static_cast<std::size_t>(most - votes_.begin());
    *most = 0;
    const std::size_t point = model_[cell / kTurns];
    const double about_rad =
        2.0 * math::kPi * (static_cast<double>(cell % kTurns) + 0.5) / static_cast<double>(kTurns);
    const double c = math::cos(about_rad);
    const double s = math::sin(about_rad);
    Mat3d about = Mat3d::Identity();
    about(1, 1) = about(2, 2) = c;
    about(1, 2) = -s;
    about(2, 1) = s;
    Pose pose = Pose::Identity();
    pose.linear() = target_frame.transpose() * about *
                    frame_about(pair.source->normal(point).cast<double>()).transpose();
    pose.translation() = place - pose.linear() * pair.source->point(point).cast<double>();
    finalists_.offer(pose);
  }
}

Status PairVoting::generate(const PairView& pair, const Correspondences&, Rng&,
                            Hypotheses& hypotheses) noexcept {
  if (pair.score == nullptr) return Error{Code::BadParameter, Stage::Coarse, 0};
  const Surface& target = *pair.target;
  finalists_.begin(pair, params_.quick_samples, params_.references * params_.peaks);
  diameter_m_ = 2.0 * finalists_.radius_m();
  if (pair.source->size < 3 || target.size < 3 || !(diameter_m_ > 0.0)) {
    return Error{Code::NoConsensus, Stage::Coarse, 0};
  }
  if (const std::uint64_t hash = hash_points(*pair.source); hash != learned_) {
    learn(*pair.source);
    learned_ = hash;
  }
  const std::size_t references = std::min(params_.references, target.size);
  for (std::size_t k = 0; k < references; ++k) {
    const std::size_t reference = k * target.size / references;
    if (!target.has_normal(reference)) continue;
    vote(target, reference);
    propose(pair, reference);
  }
  return finalists_.conclude(hypotheses);
}

}  // namespace grapnel
