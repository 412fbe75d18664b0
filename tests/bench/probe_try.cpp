#include <cstdio>
#include <cstdlib>
#include <cmath>
#include <numbers>
#include <chrono>
#include "quality_plants.h"
#include "identify/transient_modes.h"
#include "sweep/clock.h"
using namespace sinerig; using namespace sinerig::quality;
int main(int argc,char**argv){
  double T=argc>1?atof(argv[1]):0.9; int seeds=argc>2?atoi(argv[2]):2; double quiet=0.1;
  for(const char*name:{"g1","g2","g3","g4"}){ QualityPlant plant=load_plant(SINERIG_SOURCE_DIR "/config/quality",name);
   for(Noise noise:{Noise::n80,Noise::n60,Noise::l20}) { QualityCase of=make_case(plant,noise);
    for(int seed=1;seed<=seeds;++seed){
     SweepSettings sweep=plant.sweep;
     if(noise==Noise::l20) for(const double hz:asked_frequencies(plant.sweep)) sweep.amplitude_table.push_back({hz,std::numbers::sqrt2*10/std::abs(plant.response(hz))});
     VirtualClock clock{TickGrid{1000.0}}; sim::SimulatedRig rig{of.rig(seed),clock};
     identify::MotionRecord rec; rec.period_s=1e-3;
     const int n=int((T+quiet)*1000); double phase=0;
     for(int k=0;k<n;++k){ clock.wait(); double t=k*1e-3-quiet; double u=0; if(t>=0){ double f=0.5*std::pow(400.0,t/T); u=amplitude_at(sweep,f)*std::sin(phase); phase+=2*std::numbers::pi*f*1e-3; }
       Sample s=rig.actuator().write(u); Sample y=rig.sensor(0).read(); rec.input.push_back(s.value); rec.output.push_back(y.value); }
     auto t0=std::chrono::steady_clock::now();
     auto found=identify::find_modes(rec,{.lowest_hz=0.5,.highest_hz=400.0});
     double ms=std::chrono::duration<double>(std::chrono::steady_clock::now()-t0).count()*1e3;
     printf("%s %s seed %d (%.0f ms) noise ratio %.3f:",name,to_string(noise),seed,ms,std::sqrt(found.noise_variance)/of.noise_rms);
     Eigen::Index i=0; for(auto p:found.poles){ double sr=std::sqrt(found.covariance(i,i)); if(p.imag()==0){ printf(" [%.3f±%.3f Hz]",-p.real()/2/std::numbers::pi,sr/2/std::numbers::pi); i+=1;} else { double w=std::abs(p); printf(" (%.4f±%.4f Hz z %.5f±%.5f)",w/2/std::numbers::pi,std::sqrt(found.covariance(i+1,i+1))/2/std::numbers::pi,-p.real()/w,sr/w); i+=2;} }
     printf("\n"); fflush(stdout);
    }}}
}
