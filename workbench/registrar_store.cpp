#include "workbench/registrar_store.h"

#include <algorithm>
#include <utility>

namespace grapnel {

PreparedRegistrar& RegistrarStore::find_or_make(const std::string& key,
                                                const std::function<PreparedRegistrar()>& make) {
  const auto found = std::find_if(entries_.begin(), entries_.end(),
                                  [&](const Entry& entry) { return entry.key == key; });
  if (found != entries_.end()) {
    entries_.splice(entries_.begin(), entries_, found);
    return entries_.front().prepared;
  }
  // The old one's memory is free before the new one takes its own.
  while (entries_.size() >= std::max<std::size_t>(capacity_, 1)) entries_.pop_back();
  entries_.push_front({key, make()});
  return entries_.front().prepared;
}

}  // namespace grapnel
