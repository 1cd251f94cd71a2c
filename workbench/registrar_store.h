#pragma once

#include <cstddef>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <string>

#include "pipeline/registrar.h"

namespace grapnel {

/// A registrar and the model it looks for: serves job after job.
struct PreparedRegistrar {
  std::optional<Model> model;  ///< none for pairs
  std::unique_ptr<Registrar> registrar;
};

/// Keeps the registrars of the last few jobs, so that a model is read and indexed once and not for
/// every frame it is looked for in. Answers do not depend on it. One thread's own.
class RegistrarStore {
 public:
  /// At least 1; a registrar takes some 50 MB.
  explicit RegistrarStore(std::size_t capacity) : capacity_(capacity) {}

  /// The registrar under `key`, made when it is not there; the one longest not asked for goes.
  /// Valid until as many others as the capacity were asked for. What `make` throws comes through.
  PreparedRegistrar& find_or_make(const std::string& key,
                                  const std::function<PreparedRegistrar()>& make);

 private:
  struct Entry {
    std::string key;
    PreparedRegistrar prepared;
  };

  std::size_t capacity_;
  std::list<Entry> entries_;  // newest first
};

}  // namespace grapnel
