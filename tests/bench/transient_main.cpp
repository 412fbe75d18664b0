// thin experiment
#include <cstdio>
#include <random>
#include <map>
#include <string>
#include <cstdlib>
#include "quality_plants.h"
#include "support/virtual_run.h"
#include "cli/found_modes.h"
using namespace sinerig;
using namespace sinerig::quality;
int main(int argc,char**argv){
  const int seeds=argc>1?atoi(argv[1]):5; const double cycles=argc>2?atof(argv[2]):1.0; const double wrong=argc>3?atof(argv[3]):0.0;
  const std::string only=argc>4?argv[4]:"";
  const std::vector<std::pair<std::string,double>> timed={{"g1 N80",174.8},{"g1 N60",302.8},{"g1 L20",214.1},{"g2 N80",303.6},{"g2 N60",2658.3},{"g2 L20",462.5},{"g3 N80",273.6},{"g3 N60",316.0},{"g3 L20",301.1},{"g4 N80",23.3},{"g4 N60",80.7},{"g4 L20",58.0}};
  for(const char*name:{"g1","g2","g3","g4"}) {
    QualityPlant plant=load_plant(SINERIG_SOURCE_DIR "/config/quality",name);
    plant.sweep.settling=Settling::model; plant.sweep.integrate.cycles=cycles;
    for(Noise noise:{Noise::n80,Noise::n60,Noise::l20}){
      const std::string key=std::string(name)+" "+to_string(noise);
      if(!only.empty()&&key.find(only)==std::string::npos) continue;
      const QualityCase of=make_case(plant,noise);
      double seconds=0; int ok=0,cov=0,pts=0,notgood=0,detected=0; double worst=0; int silent=0,again=0; int verdicts[3]={0,0,0};
      for(int seed=1;seed<=seeds;++seed){
        KnownModes known; std::mt19937_64 rng(static_cast<unsigned long>(seed));
        std::uniform_int_distribution<int> coin(0,1); auto sign=[&]{return coin(rng)?1.0:-1.0;};
        std::size_t idx=0;
        for(std::size_t i=0;i<of.plant.modes.poles.size();++i){
          std::complex<double> p{of.plant.modes.poles[i]};
          if(p.imag()<-1e-9) continue; if(getenv("DROP")&&std::abs(std::abs(p)/6.2831853-atof(getenv("DROP")))<0.5) continue;
          ModePole pole; 
          if(std::abs(p.imag())<1e-9){ pole.sigma_rad_s=p.real()*(1+10*wrong*sign()); double sd=std::max(1e-5,10*wrong)*std::abs(p.real()); known.prior.covariance[triangle(idx)+idx]=sd*sd; idx+=1;}
          else { pole.sigma_rad_s=p.real()*(1+20*wrong*sign()); pole.omega_rad_s=p.imag()*(1+wrong*sign());
            double s1=std::max(1e-5,20*wrong)*std::abs(p.real()), s2=std::max(1e-7,wrong)*std::abs(p.imag());
            known.prior.covariance[triangle(idx)+idx]=s1*s1; known.prior.covariance[triangle(idx+1)+idx+1]=s2*s2; idx+=2;}
          known.prior.poles[known.prior.modes++]=pole;
        }
        if(getenv("ADD")){ double f=atof(getenv("ADD"))*6.2831853; known.prior.poles[known.prior.modes++]={-0.01*f,f}; known.prior.covariance[triangle(idx)+idx]=1e-6*f*f; known.prior.covariance[triangle(idx+1)+idx+1]=1e-4*f*f; }
        known.noise_variance={of.noise_rms*of.noise_rms}; known.noise_dof=500;
        RunnerSettings rs; cli::IdentifiedModes finder; if(wrong>=0) rs.modes=known; if(wrong<0||getenv("GUARD")) rs.finder=&finder;
        const test::VirtualRun run=test::run_virtual(of.plan,of.rig(static_cast<unsigned long>(seed)),test::open_guard(1),rs);
        bool in=true;
        std::map<std::uint32_t,Point> last; for(const Point&p:run.sink.points) last[p.dwell]=p;
        for(const auto&[id,p]:last){ ResponseError e=error_of(p.response,of.plant.response(p.frequency_hz));
          in=in&&within_bounds(e); worst=std::max(worst,e.gain_db); cov+=(e.gain_db<=p.gain_interval_db)+(e.phase_deg<=p.phase_interval_deg); pts++; notgood+=p.status!=PointStatus::good; detected+=p.settled_by!=SettledBy::model;
          if(p.status==PointStatus::good&&(e.gain_db>0.2||e.phase_deg>2)) silent++; if(getenv("V")) printf("%8.3f Hz %6.2f s err %.4f dB %.3f deg ci %.4f %.3f snr %.0f %s %s %s\n",p.frequency_hz,p.seconds,e.gain_db,e.phase_deg,p.gain_interval_db,p.phase_interval_deg,p.snr_db,to_string(p.status),to_string(p.reason),to_string(p.settled_by));
        }
        ok+=in; seconds+=double(run.outcome.ticks)/1000; for(const auto&ev:run.sink.events) {if(ev.kind==EventKind::model_doubted){ verdicts[int(ev.value)]++;} if(ev.kind==EventKind::remeasured) again++;}
      }
      double t=1; for(auto&x:timed) if(x.first==key) t=x.second;
      printf("%s %8.1f s  %.3f  ok %5.1f%%  worst %.3f dB covers %.1f%% notgood %.2f detected %.2f SILENT points %d doubts %d/%d/%d again %d\n",key.c_str(),seconds/seeds,seconds/seeds/t,100.0*ok/seeds,worst,50.0*cov/pts,double(notgood)/seeds,double(detected)/seeds,silent,verdicts[0],verdicts[1],verdicts[2],again);
      fflush(stdout);
    }
  }
}
