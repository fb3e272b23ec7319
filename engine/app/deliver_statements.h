// What the lab's record store has not heard of yet is told to it.
#pragma once

#include "engine/lab/delivery/outbox.h"
#include "engine/lab/store/lab.h"

#include <optional>
#include <string>

namespace stylet::app {

struct Delivery {
  lab::delivery::Sent sent{};
  lab::delivery::OutboxState left{};
};

/// Where the lab's record store is, and who the lab is: checked, and kept with the records.
/// @param endpoint   its address; empty: nothing is told any more, and what waits stays
/// @param home_page  an address of the lab's own, by which its people and activities are named; ends in "/"
/// @param key_file   "name:secret"; empty: none
/// @throws files::ContentError
void connect_record_store(lab::store::Lab& lab, const std::string& endpoint, const std::string& home_page,
                          const std::string& key_file);

/// Once through the outbox; waits for the store, ten seconds a request at most. Nothing: there is no record store.
/// @param failures  of the store in a row so far, as the last Delivery says: the wait doubles with each
/// @throws files::ContentError
std::optional<Delivery> deliver_statements(lab::store::Lab& lab, int failures = 0);

/// "3 statements delivered; 2 wait, the oldest since 2026-03-02: ..." one line.
std::string delivery_words(const Delivery& delivery);

}  // namespace stylet::app
