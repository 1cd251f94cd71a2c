#include "workbench/views/view_set.h"

#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "base/input_error.h"
#include "drivers/replay/image_file.h"
#include "drivers/replay/recording.h"
#include "pipeline/model.h"
#include "pipeline/model_normals.h"
#include "workbench/import/local_recording.h"
#include "workbench/options.h"
#include "workbench/progress.h"

namespace grapnel {
namespace {

// Axial noise of structured light is about this times z² (Khoshelham and Elberink 2012).
constexpr double kNoise_per_m = 1.425e-3;

/// A view under the name it was given by, and the one it is read by.
struct ViewName {
  std::string given;
  std::string file;
};

/// A recording as its frames' names, anything else as it is. Foreign recordings stay where they
/// were brought in as long as `local` holds them.
std::vector<ViewName> expanded(const std::vector<std::string>& names, const ViewOptions& options,
                               std::vector<std::unique_ptr<LocalRecording>>& local) {
  std::vector<ViewName> all;
  for (const std::string& name : names) {
    if (!is_recording_name(name)) {
      all.push_back({name, name});
      continue;
    }
    local.push_back(std::make_unique<LocalRecording>(name));
    const std::string folder = local.back()->folder().string();
    const std::size_t count = Recording::open(folder).frame_count();
    std::vector<std::size_t> frames;
    if (!options.frames.empty()) frames = parse_indices(options.frames, "--frames");
    for (std::size_t i = 0; options.frames.empty() && i < count; ++i) frames.push_back(i);
    for (const std::size_t frame : frames) {
      if (frame >= count) {
        throw InputError(name + "#" + std::to_string(frame) + ": the recording has frames 0 to " +
                         std::to_string(count - 1));
      }
      const std::string number = std::to_string(frame);
      all.push_back({name + "#" + number, folder + "#" + number});
    }
  }
  if (!options.frames.empty() && local.empty()) {
    throw InputError("--frames " + options.frames + ": no view is a recording");
  }
  return all;
}

void apply_mask(FrameFile& file, const std::string& mask_name) {
  const ColorImage mask = read_color_image(mask_name);
  if (mask.width != file.camera.width || mask.height != file.camera.height) {
    throw InputError(mask_name + ": " + std::to_string(mask.width) + "×" +
                     std::to_string(mask.height) + " pixels; the view has " +
                     std::to_string(file.camera.width) + "×" + std::to_string(file.camera.height));
  }
  for (std::size_t i = 0; i < file.depth.size(); ++i) {
    if (mask.pixels[i] == Rgb8{}) file.depth[i] = 0;
  }
}

void crop_frame(FrameFile& file, const Box& box) {
  const DepthFrame frame = file.frame();
  std::size_t pixel = 0;
  for (int v = 0; v < frame.depth.height; ++v) {
    for (int u = 0; u < frame.depth.width; ++u, ++pixel) {
      if (file.depth[pixel] == 0) continue;
      if (!box.contains(point_of_pixel(frame, u, v).cast<double>())) file.depth[pixel] = 0;
    }
  }
}

void crop_cloud(CloudData& cloud, const Box& box) {
  const float none = std::numeric_limits<float>::quiet_NaN();
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (box.contains(Vec3d(cloud.x[i], cloud.y[i], cloud.z[i]))) continue;
    cloud.x[i] = cloud.y[i] = cloud.z[i] = none;
  }
}

View load_view(const ViewName& view_name, const std::string& mask, const ViewOptions& options) {
  const std::string& name = view_name.given;
  InputOptions input_options = options.input;
  if (name.find('#') != std::string::npos) input_options = {};
  View view{name, load_input(view_name.file, input_options), nullptr};
  if (view.input.is_frame()) {
    auto& file = std::get<FrameFile>(view.input.data);
    if (!mask.empty()) apply_mask(file, mask);
    crop_frame(file, options.crop);
  } else {
    if (!mask.empty()) throw InputError(name + ": a cloud takes no --mask");
    crop_cloud(std::get<CloudData>(view.input.data), options.crop);
  }
  view.surface = make_surface(view.input);
  if (view.surface->surface.size == 0) throw InputError(name + ": the view has no reading");
  return view;
}

Model model_of(const Surface& surface) {
  Model model;
  for (std::size_t i = 0; i < surface.size; ++i) {
    model.x.push_back(surface.x[i]);
    model.y.push_back(surface.y[i]);
    model.z.push_back(surface.z[i]);
  }
  return model;
}

std::vector<SurfaceSample> cloud_samples(const Surface& surface) {
  bool complete = true;
  for (std::size_t i = 0; i < surface.size; ++i) complete = complete && surface.has_normal(i);
  Model estimated;
  if (!complete) {
    estimated = model_of(surface);
    estimate_model_normals(estimated);
  }
  std::vector<SurfaceSample> samples;
  for (std::size_t i = 0; i < surface.size; ++i) {
    SurfaceSample sample;
    sample.point = surface.point(i);
    sample.intensity = surface.intensity[i];
    sample.normal = surface.has_normal(i)
                        ? surface.normal(i)
                        : Vec3f(estimated.nx[i], estimated.ny[i], estimated.nz[i]);
    const Vec3f sight = surface.viewpoint - sample.point;
    double sigma_m = 0.001;  // equal weights where nobody knows the distance
    if (surface.has_viewpoint) {
      if (sample.normal.dot(sight) < 0.0F) sample.normal = -sample.normal;
      sigma_m = kNoise_per_m * std::max(1e-6, static_cast<double>(sight.squaredNorm()));
    }
    sample.weight = static_cast<float>(1.0 / (sigma_m * sigma_m));
    samples.push_back(sample);
  }
  return samples;
}

}  // namespace

std::vector<View> load_views(const std::vector<std::string>& names, const ViewOptions& options) {
  std::vector<std::unique_ptr<LocalRecording>> local;
  const std::vector<ViewName> all = expanded(names, options, local);
  if (options.masks.size() > 1 && options.masks.size() != all.size()) {
    throw InputError("--mask: " + std::to_string(options.masks.size()) + " images for " +
                     std::to_string(all.size()) + " views; one, or one a view are allowed");
  }
  std::vector<View> views;
  Progress progress("views", all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::string mask =
        options.masks.empty() ? "" : options.masks[options.masks.size() == 1 ? 0 : i];
    views.push_back(load_view(all[i], mask, options));
    progress.step();
  }
  return views;
}

std::vector<SurfaceSample> view_samples(const View& view) {
  if (view.input.is_frame()) return frame_samples(view.input.frame(), {});
  return cloud_samples(view.surface->surface);
}

std::vector<Vec3f> sampled_points(const View& view, std::size_t count) {
  const Surface& surface = view.surface->surface;
  const std::size_t step = std::max<std::size_t>(1, (surface.size + count - 1) / count);
  std::vector<Vec3f> points;
  for (std::size_t i = 0; i < surface.size; i += step) points.push_back(surface.point(i));
  return points;
}

}  // namespace grapnel
