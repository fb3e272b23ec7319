// Holds the precompiled headers of stylet.cmake; nothing else.
