// A shared object that is loadable but no camera plug-in.
extern "C" int grapnel_nothing() { return 0; }
