#include "workbench/views/common_frame_json.h"

#include <array>
#include <cstdio>

#include "base/code.h"

namespace grapnel {
namespace {

/// The best answer among a view's edges to the first view's part: why it is not enough.
std::string why_apart(const CommonFrame& frame, std::size_t view) {
  const ViewEdge* best = nullptr;
  bool switched_off = false;
  for (const ViewEdge& edge : frame.edges) {
    if (edge.source != view && edge.target != view) continue;
    const std::size_t other = edge.source == view ? edge.target : edge.source;
    if (!frame.views[other].connected) continue;
    switched_off = switched_off || edge.fate == EdgeFate::SwitchedOff;
    if (edge.fate != EdgeFate::Rejected || edge.answer.reasons.empty()) continue;
    if (best == nullptr || edge.answer.report.fitness > best->answer.report.fitness) best = &edge;
  }
  if (switched_off) return "its accepted edges are contradicted by the other views";
  if (best == nullptr) return "no other view of the first one's part was tried";
  return "the nearest of its pairs was rejected: " + best->answer.reasons.front();
}

nlohmann::ordered_json view_json(const View& view, const PlacedView& placed) {
  nlohmann::ordered_json json;
  json["view"] = view.name;
  json["connected"] = placed.connected;
  json["confirmed"] = placed.confirmed;
  json["part"] = placed.part;
  if (placed.connected) json["transform"] = pose_json(placed.part_from_view);
  return json;
}

nlohmann::ordered_json edge_json(const ViewEdge& edge) {
  const RegistrationReport& report = edge.answer.report;
  nlohmann::ordered_json json;
  json["source"] = edge.source;
  json["target"] = edge.target;
  json["fate"] = fate_name(edge.fate);
  json["status"] = status_name(edge.answer.status);
  json["code"] = static_cast<unsigned>(edge.answer.code);
  json["reasons"] = edge.answer.reasons;
  if (report.has_pose) json["transform"] = pose_json(report.target_from_source);
  json["fitness"] = report.fitness;
  json["rmse_m"] = report.rmse_m;
  json["coverage"] = report.coverage;
  json["free_space_violation"] = report.free_space_violation;
  json["margin"] = report.margin;
  json["line"] = edge.line;
  json["residual_sigma"] = edge.residual_sigma;
  json["seed"] = edge.answer.seed;
  json["total_ms"] = edge.answer.total_ms;
  return json;
}

std::size_t count_of(const CommonFrame& frame, EdgeFate fate) {
  std::size_t count = 0;
  for (const ViewEdge& edge : frame.edges) count += edge.fate == fate ? 1 : 0;
  return count;
}

}  // namespace

const char* fate_name(EdgeFate fate) noexcept {
  static constexpr std::array<const char*, 4> kNames = {"tree", "loop", "switched_off", "rejected"};
  return kNames[static_cast<std::size_t>(fate)];
}

std::vector<std::string> reasons_of(const std::vector<View>& views, const CommonFrame& frame) {
  std::vector<std::string> reasons;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (frame.views[i].connected) continue;
    reasons.push_back("view " + std::to_string(i) + " (" + views[i].name +
                      ") is not connected to the first one: " + why_apart(frame, i));
  }
  return reasons;
}

nlohmann::ordered_json common_frame_json(const std::vector<View>& views, const CommonFrame& frame) {
  nlohmann::ordered_json json;
  json["status"] = frame.complete() ? "accepted" : "rejected";
  json["code"] =
      static_cast<unsigned>(frame.complete() ? Code::ObjectFound : Code::NoObjectAccepted);
  json["reasons"] = reasons_of(views, frame);
  json["views"] = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < views.size(); ++i) {
    json["views"].push_back(view_json(views[i], frame.views[i]));
  }
  json["parts"] = frame.parts;
  json["edges"] = nlohmann::ordered_json::array();
  for (const ViewEdge& edge : frame.edges) json["edges"].push_back(edge_json(edge));
  json["edges_used"] = count_of(frame, EdgeFate::Tree) + count_of(frame, EdgeFate::Loop);
  json["edges_dropped"] =
      count_of(frame, EdgeFate::SwitchedOff) + count_of(frame, EdgeFate::Rejected);
  json["loops"] = {{"count", frame.loops.loops},
                   {"rms_m", frame.loops.rms_m},
                   {"max_m", frame.loops.max_m},
                   {"max_rad", frame.loops.max_rad}};
  if (frame.joint.done) {
    json["joint"] = {{"rms_m", frame.joint.rms_m},
                     {"partners", frame.joint.partners},
                     {"focal_factor", frame.joint.focal_factor},
                     {"focal_sigma", frame.joint.focal_sigma}};
  }
  json["iterations"] = frame.iterations;
  return json;
}

std::string common_frame_text(const std::vector<View>& views, const CommonFrame& frame) {
  std::size_t connected = 0;
  for (const PlacedView& view : frame.views) connected += view.connected ? 1 : 0;
  std::array<char, 256> line{};
  std::snprintf(line.data(), line.size(), "%zu of %zu views in the first one's frame.\n", connected,
                views.size());
  std::string text = line.data();
  for (const std::string& reason : reasons_of(views, frame)) text += "  " + reason + "\n";
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (!frame.views[i].connected || frame.views[i].confirmed) continue;
    text += "  view " + std::to_string(i) + " (" + views[i].name +
            ") hangs on a single pair: no loop confirms it\n";
  }
  std::snprintf(line.data(), line.size(),
                "pairs: %zu in the tree, %zu confirm, %zu contradicted by the others, %zu "
                "rejected\nloops of three: %zu, rms %.2f mm, max %.2f mm, %.4f rad\n",
                count_of(frame, EdgeFate::Tree), count_of(frame, EdgeFate::Loop),
                count_of(frame, EdgeFate::SwitchedOff), count_of(frame, EdgeFate::Rejected),
                frame.loops.loops, frame.loops.rms_m * 1e3, frame.loops.max_m * 1e3,
                frame.loops.max_rad);
  text += line.data();
  if (!frame.joint.done) return text;
  std::snprintf(line.data(), line.size(),
                "where views overlap: rms %.2f mm; they fit best with focal lengths times %.4f "
                "(sigma %.4f)\n",
                frame.joint.rms_m * 1e3, frame.joint.focal_factor, frame.joint.focal_sigma);
  return text + line.data();
}

}  // namespace grapnel
