#include <exception>
#include <iostream>
#include <vector>

#include "drivers/synthetic/shipped_models.h"

/// Writes the models of config/models/ into a folder: grapnel-make-models OUT.
int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: grapnel-make-models OUT\n";
    return 2;
  }
  try {
    const std::vector<grapnel::ShippedModel> models = grapnel::make_shipped_models();
    grapnel::write_models(models, argv[1]);
    for (const grapnel::ShippedModel& model : models) {
      std::cout << model.name << ": " << model.cloud.size() << " points\n";
    }
  } catch (const std::exception& error) {
    std::cerr << "grapnel-make-models: " << error.what() << "\n";
    return 2;
  }
  return 0;
}
