// The catalogues of other languages: content/texts/LANGUAGE.json, English to the other language.
#pragma once

#include "engine/content/texts.h"

#include <filesystem>
#include <string>
#include <vector>

namespace stylet::readers {

/// @throws ContentError  it cannot be read, or is none
content::Texts read_texts(const std::filesystem::path& path);

/// That there are catalogues for: "de", "en".
std::vector<std::string> languages();

/// As its speakers call it: "Deutsch". @throws ContentError  its catalogue cannot be read
std::string language_name(const std::string& language);
/// Of LC_ALL, LC_MESSAGES or LANG, where there is a catalogue for it; else "en".
std::string language_of_environment();

/// The catalogue of a language. @param language  "de", "en"; empty: language_of_environment()
/// @throws ContentError  there is none for a language that is named
content::Texts find_texts(const std::string& language);

}  // namespace stylet::readers
